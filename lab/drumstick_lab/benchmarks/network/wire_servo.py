"""A stand-in for the servo, a process of its own: strikes at any rate into a real block, each with its tick's time.

It ticks at 1 kHz, at the strikes' rate where that is higher, and publishes a stick that comes down evenly to each strike.
python wire_servo.py FOLDER RATE_HZ SECONDS PORT. After each strike a bare datagram with the same number goes to
127.0.0.1:PORT: what the machine's own sockets and scheduler cost. Prints how many it made and how many found no room.
"""

import os
import select
import socket
import struct
import sys
import time
from pathlib import Path

import numpy as np

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import limits
from haptic_server.block_header import HEARTBEAT
from haptic_server.files import GRANTED, SCENE
from haptic_server.records import EVENT, PLAYING, STATUS, STRIKE
from haptic_server.specification import EXACT_STICK
from realtime import ring, triple_buffer
from realtime.atomics import poke

BARE = struct.Struct("<q")
WARM_S = 1.0
TICKS_HZ = 1000.0
SPEED_M_PER_S = 0.6


def main(folder: Path, rate_Hz: float, seconds: float, port: int) -> None:
    """Make the block, wait for a gateway to take it, strike."""
    scene = parse(shipped_text("roll"), "roll")
    (folder / SCENE).write_text(shipped_text("roll"), encoding="utf-8")
    (folder / GRANTED).write_text("{}", encoding="utf-8")
    limits.write(folder, limits.limits_of(scene, EXACT_STICK))
    block = blocks.create(folder, law_of(scene))
    event, status = np.zeros(1, EVENT), np.zeros(1, STATUS)
    event["kind"], event["speed_m_per_s"], event["peak_N"], event["contact_s"] = (
        STRIKE,
        SPEED_M_PER_S,
        5.0,
        0.005,
    )
    event["level"] = 0.3
    status["status"], status["v_m_per_s"] = PLAYING, -SPEED_M_PER_S
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
    except PermissionError:
        print("servo: no real-time priority", file=sys.stderr)
    bare = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    while not select.select([sys.stdin], [], [], 0.02)[0]:  # until gateway and listeners are there
        poke(block.control, HEARTBEAT, time.monotonic_ns())
    between = max(1, round(TICKS_HZ / rate_Hz))  # ticks from strike to strike
    period_ns = round(1e9 / rate_Hz / between)
    due = time.monotonic_ns() + period_ns
    ticks = np.zeros(round(rate_Hz * (WARM_S + seconds)), np.int64)
    for tick in range(1, len(ticks) * between + 1):
        while (left_ns := due - time.monotonic_ns()) > 0:
            time.sleep(left_ns / 1e9)
        now = time.monotonic_ns()
        made, after = divmod(tick, between)
        if after == 0:
            event["seq"], event["t_ns"] = made, now
            ring.push(block.ring_cells, block.events, event[0])
            bare.sendto(BARE.pack(made), ("127.0.0.1", port))
            ticks[made - 1] = now
        poke(block.control, HEARTBEAT, now)
        status["t_ns"], status["strikes"] = now, made
        status["z_m"] = SPEED_M_PER_S * (between - after) * period_ns * 1e-9
        triple_buffer.publish(block.status_cells, block.status, status[0])
        due += period_ns
    end = time.monotonic() + 2.0
    while time.monotonic() < end:  # what waits in the ring goes out meanwhile
        poke(block.control, HEARTBEAT, time.monotonic_ns())
        time.sleep(0.02)
    np.save(folder / "ticks.npy", ticks)
    print(len(ticks), int(block.ring_cells[ring.DROPPED]), flush=True)


def warm_up() -> None:
    """Compile what the loop calls, so that its first strikes are in time."""
    block = blocks.in_memory(law_of(parse(shipped_text("roll"), "roll")))
    ring.push(block.ring_cells, block.events, np.zeros(1, EVENT)[0])
    triple_buffer.publish(block.status_cells, block.status, np.zeros(1, STATUS)[0])
    poke(block.control, HEARTBEAT, 0)


if __name__ == "__main__":
    warm_up()
    main(Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4]))
