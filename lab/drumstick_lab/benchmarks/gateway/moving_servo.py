"""A stand-in for the servo, a process of its own: ticks at 1 kHz and publishes a stick that rests, moves or rolls.

python -m drumstick_lab.benchmarks.gateway.moving_servo FOLDER PORT. It reads lines MOTION SECONDS and prints the numbers
of the first and of the last strike of each. After each strike a bare datagram with its number goes to 127.0.0.1:PORT.
The ticks of all strikes go to FOLDER/ticks.npy at the end of the input.
"""

import math
import os
import random
import select
import socket
import sys
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick_lab.benchmarks.network.wire_servo import BARE, warm_up
from haptic_server import block as blocks
from haptic_server import limits
from haptic_server.block_header import HEARTBEAT
from haptic_server.files import GRANTED, SCENE
from haptic_server.records import EVENT, PLAYING, RELEASE, STATUS, STRIKE
from haptic_server.specification import EXACT_STICK
from realtime import ring, triple_buffer
from realtime.atomics import poke

PERIOD_NS = 1_000_000
RATE_HZ, SPEED_M_PER_S, CONTACT_S = 23.05, 0.63, 0.0054  # of the scene `roll`
NOTHING = 0
Moment = tuple[float, float, int]  # height m, speed m/s, what began


def lying() -> Iterator[Moment]:
    """A stick that lies in the head."""
    while True:
        yield -1e-4, 0.0, NOTHING


def swung() -> Iterator[Moment]:
    """A stick that a hand swings above the head, three times a second, down to 2 cm."""
    for tick in count():
        angle = 2.0 * math.pi * 3.0 * tick * 1e-3
        yield 0.05 + 0.03 * math.sin(angle), 0.03 * 6.0 * math.pi * math.cos(angle), NOTHING


def rolling() -> Iterator[Moment]:
    """A roll: flights and half waves of contact."""
    flight_s = 1.0 / RATE_HZ - CONTACT_S
    was_inside = False
    for tick in count():
        t = (tick * 1e-3) % (1.0 / RATE_HZ)
        inside = t >= flight_s
        what = (STRIKE if inside else RELEASE) if inside != was_inside else NOTHING
        was_inside = inside
        angle = math.pi * (t - flight_s) / CONTACT_S
        if inside:
            yield (
                -SPEED_M_PER_S * CONTACT_S / math.pi * math.sin(angle),
                -SPEED_M_PER_S * math.cos(angle),
                what,
            )
        else:
            fallen = t / flight_s
            yield SPEED_M_PER_S * t * (1.0 - fallen), SPEED_M_PER_S * (1.0 - 2.0 * fallen), what


def unforeseen() -> Iterator[Moment]:
    """Strikes of a stick that was held still 5 cm above the head a moment before, ten a second at random."""
    draw = random.Random(1)
    while True:
        for _ in range(draw.randrange(60, 140)):
            yield 0.05, 0.0, NOTHING
        yield 0.05, 0.0, STRIKE


MOTIONS = {"lying": lying, "swung": swung, "rolling": rolling, "unforeseen": unforeseen}


class Stand:
    """The block and what goes into it."""

    def __init__(self, folder: Path, port: int) -> None:
        scene = parse(shipped_text("roll"), "roll")
        (folder / SCENE).write_text(shipped_text("roll"), encoding="utf-8")
        (folder / GRANTED).write_text("{}", encoding="utf-8")
        limits.write(folder, limits.limits_of(scene, EXACT_STICK))
        self._block = blocks.create(folder, law_of(scene))
        self._event, self._status = np.zeros(1, EVENT), np.zeros(1, STATUS)
        for name, value in (
            ("speed_m_per_s", 0.6),
            ("peak_N", 5.0),
            ("contact_s", CONTACT_S),
            ("level", 0.3),
        ):
            self._event[name] = value
        self._status["status"] = PLAYING
        self._bare, self._port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), port
        self.ticks: list[int] = []

    def live(self) -> None:
        """Say that the servo lives, without a tick."""
        poke(self._block.control, HEARTBEAT, time.monotonic_ns())

    def _tick(self, now: int, moment: Moment) -> None:
        z_m, v, what = moment
        block, event, status = self._block, self._event, self._status
        if what != NOTHING:
            event["kind"], event["t_ns"] = what, now
            event["seq"] = len(self.ticks) + (what == STRIKE)
            ring.push(block.ring_cells, block.events, event[0])
        if what == STRIKE:
            self._bare.sendto(BARE.pack(len(self.ticks) + 1), ("127.0.0.1", self._port))
            self.ticks.append(now)
        poke(block.control, HEARTBEAT, now)
        status["t_ns"], status["z_m"], status["v_m_per_s"], status["strikes"] = now, z_m, v, len(self.ticks)
        triple_buffer.publish(block.status_cells, block.status, status[0])

    def play(self, motion: Iterator[Moment], seconds: float) -> None:
        """Tick for so long."""
        due = time.monotonic_ns()
        end = due + round(seconds * 1e9)
        while due < end:
            while (left_ns := due - time.monotonic_ns()) > 0:
                time.sleep(left_ns / 1e9)
            self._tick(time.monotonic_ns(), next(motion))
            due += PERIOD_NS


def main(folder: Path, port: int) -> None:
    """Make the block, and play what is asked for."""
    stand = Stand(folder, port)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(80))
    except PermissionError:
        print("servo: no real-time priority", file=sys.stderr)
    while True:
        while not select.select([sys.stdin], [], [], 0.02)[0]:
            stand.live()
        words = sys.stdin.readline().split()
        if not words:
            break
        first = len(stand.ticks) + 1
        stand.play(MOTIONS[words[0]](), float(words[1]))
        print(first, len(stand.ticks), flush=True)
    np.save(folder / "ticks.npy", np.array(stand.ticks, np.int64))


if __name__ == "__main__":
    warm_up()
    main(Path(sys.argv[1]), int(sys.argv[2]))
