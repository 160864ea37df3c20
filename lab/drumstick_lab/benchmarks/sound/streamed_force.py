"""Cost and error of a streamed force: drumstick lab streamed-force [--runs 15].

Truth: a half-sine blow of the scene `roll`, told as means over ticks of the servo, beside the analytic blow; the error
of the sound below a quarter and below half of the servo's rate, and of the force's peak. Cost, interleaved, CPU time of
the thread: a tick of the servo that does not stream, that streams to nobody, and that streams; a step of a ringing mesh
without a stream, with one at rest, and with one that plays; a piece in the gateway and in the sound server.
"""

import argparse
import dataclasses
import math
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.excitation.feed import Feed
from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.memory.timeline import stream_of
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick_lab.measuring import stored
from haptic_server import block as blocks
from haptic_server.contacts import LISTENED, SAMPLE, SLOTS
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from protocol.messages import CONTACT_PIECE_S, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime import ring
from realtime.atomics import poke
from realtime.records import is_there
from sound_server.receiving.contacts import ContactScheduler

RATE_HZ = 48_000
TICKS = 10_000
FRAMES = 24_000
SERVO_RATES_HZ = (500, 1000, 2000, 4000)


def roll(streamed: bool) -> Scene:
    text = shipped_text("roll")
    return parse(text.replace("[drum]", '[drum]\nexcitation = "streamed"') if streamed else text, "roll")


def truth(rate_Hz: int) -> dict[str, float]:
    """Errors of a blow of 1 m/s, on average over eight places between two ticks."""
    found: list[tuple[float, float, float]] = []
    for place in range(8):
        at_s = 0.05 + place / 8.0 / rate_Hz
        # Without an impulse, the analytic force is the half-sine of its peak.
        blow = dataclasses.replace(strike_for_speed(roll(False), 1.0, 0.5, 0.0, at_s), impulse_N_s=0.0)
        first = math.floor(blow.t_s * rate_Hz)
        ends = (first + np.arange(math.ceil(blow.contact_s * rate_Hz) + 3)) / rate_Hz - blow.t_s
        turn = math.pi * np.clip(ends / blow.contact_s, 0.0, 1.0)
        forces = np.diff(blow.peak_N * blow.contact_s / math.pi * (1.0 - np.cos(turn))) * rate_Hz
        press = StreamedContact(first, float(rate_Hz), blow.x, blow.y, forces)
        wanted = np.fft.rfft(render(roll(False), [blow], 0.5, RATE_HZ)[:, 0])
        got = np.fft.rfft(render(roll(True), [], 0.5, RATE_HZ, [press])[:, 0])
        f_Hz = np.fft.rfftfreq(RATE_HZ // 2, 1.0 / RATE_HZ)
        quarter, half = (
            float(np.linalg.norm((got - wanted)[f_Hz < top]) / np.linalg.norm(wanted[f_Hz < top]))
            for top in (rate_Hz / 4, rate_Hz / 2)
        )
        found.append((quarter, half, float(forces.max() / blow.peak_N - 1.0)))
    quarter, half, peak = np.mean(found, axis=0)
    return {"error_below_a_quarter": quarter, "error_below_half": half, "peak_of_samples": peak}


def servo_case(streamed: bool, listened: bool) -> Callable[[], float]:
    """Makes TICKS ticks and returns ns of CPU a tick."""
    scene = roll(streamed)
    servo = memory.prepare(scene, blocks.in_memory(law_of(scene)))
    samples, now = np.zeros(SLOTS, SAMPLE), [0]

    def run() -> float:
        if is_there(servo.stream):
            poke(servo.stream.contacts.cells, LISTENED, int(listened))
            ring.drain(servo.stream.contacts.cells, servo.stream.contacts.slots, samples)
        begun = time.thread_time_ns()
        now[0] = loop.run_virtual(servo, TICKS, now[0])
        return (time.thread_time_ns() - begun) / TICKS

    run()
    return run


def mesh_case(streamed: bool, plays: bool) -> Callable[[], float]:
    """Renders FRAMES of a ringing head and returns ns of CPU a step of the mesh."""
    scene = roll(streamed)
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, t60_s=20.0))
    strikes = StrikeRing()
    engine = new_engine(scene, RATE_HZ, strikes)
    out, tick = np.zeros((FRAMES, 2), np.float32), [0]
    forces = 3.0 + np.random.default_rng(1).normal(size=600).astype(np.float32)

    def run() -> float:
        strikes.push(0, 0.5, 0.0, 5.0, 0.005)
        if plays and is_there(engine.stream):
            Feed(engine.stream).push(1, tick[0], 10**9, 1e6, 0.5, 0.0, forces)
            tick[0] += 1000
        steps = int(engine.control["steps"][0])
        begun = time.thread_time_ns()
        render_all(engine, out, 128, 10**9)
        return (time.thread_time_ns() - begun) / (int(engine.control["steps"][0]) - steps)

    run()
    return run


def piece_cases() -> tuple[Callable[[], float], Callable[[], float]]:
    """Us of CPU for one piece: gathered and encoded in the gateway; taken in the sound server."""
    samples = np.zeros(1000, SAMPLE)
    samples["seq"], samples["tick"], samples["force_N"] = 1, np.arange(1000), 2.0
    samples["t_ns"] = samples["tick"] * 1_000_000
    messages: list[bytes] = []
    boot = [0]

    def gateway() -> float:
        boot[0] += 1
        messages.clear()
        begun = time.thread_time_ns()
        messages.extend(encode(piece) for piece in Pieces(1000.0).of(boot[0], samples, 0))
        return (time.thread_time_ns() - begun) / len(messages) / 1e3

    def sound() -> float:
        stream = stream_of(roll(True), 1.0 / 16_000.0)
        scheduler = ContactScheduler(RateLimitedLog(lambda: 0), lambda _boot: None)
        scheduler.play_on(stream, 0.02)
        begun = time.thread_time_ns()
        for payload in messages[:200]:
            scheduler.take(payload, 0)
        return (time.thread_time_ns() - begun) / 200.0 / 1e3

    gateway()
    sound()
    return gateway, sound


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=15)
    runs = parser.parse_args().runs
    gateway, sound = piece_cases()
    cases: dict[str, Callable[[], float]] = {
        "tick, analytic, ns": servo_case(False, False),
        "tick, streamed to nobody, ns": servo_case(True, False),
        "tick, streamed, ns": servo_case(True, True),
        "mesh step, analytic, ns": mesh_case(False, False),
        "mesh step, stream at rest, ns": mesh_case(True, False),
        "mesh step, stream plays, ns": mesh_case(True, True),
        "piece, gateway, us": gateway,
        "piece, sound server, us": sound,
    }
    spent: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(runs):
        for name, run in cases.items():
            spent[name].append(run())
    result: dict[str, Any] = {
        "runs": runs,
        "delay_without_block_s": 3.0 * CONTACT_PIECE_S,
        "truth": {str(rate): truth(rate) for rate in SERVO_RATES_HZ},
        "cost": {name: statistics.median(values) for name, values in spent.items()},
    }
    for name in ("truth", "cost"):
        for row, value in result[name].items():
            print(row, value)
    stored.store("streamed_force", result)


if __name__ == "__main__":
    main()
