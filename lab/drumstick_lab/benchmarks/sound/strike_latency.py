"""From a strike message to the audio device: drumstick lab strike-latency [--strikes 400].

Messages as they come from the network, at moments that know nothing of the device's blocks, go into the sound server's
StrikeScheduler; the drum plays on a device that keeps time (JACK's dummy driver, 128 frames at 48 kHz) through the server's
own sink. Milliseconds from the message to the block in which its force enters the mesh, begun; and to that block handed
to the device. What comes after is told apart: the interpolator's delay and the device's own latency. With the
interpreter idle, and with a thread of the same process sorting in pure Python.
"""

import argparse
import random
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.upsample import TAPS
from drumstick.parameters.scene import Scene
from drumstick_lab.benchmarks.sound.audio_live import Work, idle, sorting
from drumstick_lab.benchmarks.sound.jack_device import RATE_HZ, dummy_device
from drumstick_lab.measuring import stored
from protocol.messages import Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.strikes import StrikeScheduler
from sound_server.sinks.selection import named_device

if TYPE_CHECKING:  # it loads PortAudio, which must find the JACK server running
    from sound_server.sinks.device import DeviceSink

BLOCK = 128
BLOCK_MS = 1e3 * BLOCK / RATE_HZ
GOAL_MS = BLOCK_MS + 1.0
SCENE = Scene("drum")
# Apart by a random time; all strikes must fit into what the sink remembers of its blocks.
APART_S = (0.012, 0.024)
MOST = 500


def message(seq: int) -> bytes:
    blow = strike_for_speed(SCENE, 1.0, 0.5, 0.0)
    return encode(
        Strike(
            boot=1,
            seq=seq,
            t_ns=time.monotonic_ns(),
            x=blow.x,
            y=blow.y,
            z_speed_m_per_s=1.0,
            level=0.5,
            peak_estimate_N=blow.peak_N,
            contact_estimate_s=blow.contact_s,
        )
    )


def latencies_ms(
    sink: "DeviceSink", scheduler: StrikeScheduler, first: int, strikes: int, work: Work
) -> dict[str, dict[str, float]]:
    stop = threading.Event()
    worker = threading.Thread(target=work, args=(stop,), daemon=True)
    worker.start()
    sent: list[int] = []
    chance = random.Random(1)
    for seq in range(first, first + strikes):
        payload = message(seq)
        sent.append(time.monotonic_ns())
        scheduler.take(payload, sent[-1])
        time.sleep(chance.uniform(*APART_S))
    blocks = sink.blocks
    stop.set()
    worker.join()
    assert not sink.lost, sink.lost
    # The first block that had been given the n-th pulse is the one in which it enters the mesh.
    entered = np.searchsorted(blocks[:, 2], np.arange(first, first + strikes) + 1)
    assert entered.max() < len(blocks), "a strike was never played"
    begun, spent = blocks[entered, 0], blocks[entered, 1]
    times = {"entered": begun - sent, "handed": begun + spent - sent}
    named = {"p50": 50.0, "p90": 90.0, "p99": 99.0, "max": 100.0}
    return {
        name: {word: float(np.percentile(late, at)) * 1e-6 for word, at in named.items()}
        for name, late in times.items()
    }


def measured(strikes: int) -> dict[str, Any]:
    ring = StrikeRing()
    scheduler = StrikeScheduler(ring, RateLimitedLog(time.monotonic_ns), lambda boot: None)
    engine = build(SCENE, RATE_HZ, ring)
    with dummy_device(BLOCK) as name:
        from sound_server.sinks.device import DeviceSink

        sink = named_device(name, RATE_HZ, BLOCK)
        assert isinstance(sink, DeviceSink)
        sink.mixer.enter(engine)
        rows = {
            work.__name__: latencies_ms(sink, scheduler, first, strikes, work)
            for first, work in ((0, idle), (strikes, sorting))
        }
        device_ms, xruns = sink.latency_ms, sink.xruns
        sink.close()
    assert scheduler.played == 2 * strikes, (
        scheduler.played,
        scheduler.late,
        scheduler.duplicates,
        scheduler.refused,
    )
    divisor = int(engine.control["divisor"][0])
    return {
        "block_ms": BLOCK_MS,
        "strikes": strikes,
        "rows_ms": rows,
        "then_interpolator_ms": 1e3 * TAPS / 2 * divisor / RATE_HZ,
        "then_device_ms": device_ms,
        "xruns": xruns,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strikes", type=int, default=400)
    strikes = parser.parse_args().strikes
    if not 1 <= strikes <= MOST:
        parser.error(f"--strikes {strikes}: 1 .. {MOST}")
    found = measured(strikes)
    for work, row in found["rows_ms"].items():
        for name, late in row.items():
            words = ", ".join(f"{at} {value:.2f}" for at, value in late.items())
            print(f"{work:8s} {name:8s} {words} ms (a block is {BLOCK_MS:.2f} ms)")
        if row["handed"]["p50"] > GOAL_MS:
            print(f"         above the goal: p50 {GOAL_MS:.2f} ms")
    print(
        f"then the interpolator: {found['then_interpolator_ms']:.2f} ms, the device: {found['then_device_ms']:.2f} ms"
    )
    stored.store("strike_latency", found)


if __name__ == "__main__":
    main()
