"""Cost of a mallet: drumstick lab mallet [--runs 15].

CPU time of the thread, interleaved: a step of a ringing head that strikes excite; the same with mallets while none
plays; while one of wood or of felt is pressed in. On `roll`, on `tom`, whose glide has to agree with each push, and on
the modes of `roll`. Then a thousand strikes a second, as a share of the time that they sound. And what two strokes of a roll at the same speed
have in common.
"""

import argparse
import dataclasses
import json
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.drum.step import step
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import MATERIALS, Mallet
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import is_there

RATE_HZ = 48_000
STEPS, FIRST = 300, 20  # timed, and before them
STRIKES_PER_S = 1_000
ON_MODES = " on modes"
DRUMS = ("roll", "tom", f"roll{ON_MODES}")
APART_S = 0.043


def scene_of(name: str, material: str | None, **numbers: float) -> Scene:
    """A shipped scene's drum, or the modes of it, struck by its own strikes or by a mallet with these numbers."""
    shipped = name.removesuffix(ON_MODES)
    scene = parse(shipped_text(shipped), shipped)
    if shipped != name:
        scene = dataclasses.replace(scene, modal=Modal())
    if material is None:
        drum = dataclasses.replace(scene.drum, excitation="analytic")
        return dataclasses.replace(scene, drum=drum, mallet=None)
    values: dict[str, Any] = {"material": material, **MATERIALS[material], **numbers}
    drum = dataclasses.replace(scene.drum, excitation="mallet")
    return dataclasses.replace(scene, drum=drum, mallet=Mallet(**values))


@njit()
def _stepped(engine: Engine, steps: int) -> None:
    lent, mode = borrowed_view(engine), flush_denormals()
    for n in range(steps):
        step(lent, steps - n)
    restore(mode)


def step_case(name: str, material: str | None, touches: bool) -> Callable[[], float]:
    """Takes STEPS steps of a ringing head and returns ns of CPU a step; `touches`: a kilogram lies on it meanwhile."""
    scene = scene_of(name, material, mass_kg=1.0) if touches else scene_of(name, material)
    ring = StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    out = np.zeros((RATE_HZ // 4, 2), np.float32)

    def run() -> float:
        ring.push_blow(strike_for_speed(scene, 1.0, 0.5, 0.0))
        render_all(engine, out[:128] if touches else out, 128, 10**9)
        _stepped(engine, FIRST)
        begun = time.thread_time_ns()
        _stepped(engine, STEPS)
        spent = (time.thread_time_ns() - begun) / STEPS
        if is_there(engine.mallets):
            assert bool((engine.mallets.pool["force"] > 0.0).any()) == touches
            render_all(engine, np.zeros((RATE_HZ, 2), np.float32), 128, 10**9)  # it leaves
        return spent

    run()
    return run


def many_strikes(name: str) -> float:
    """CPU time of a second with a thousand strikes all over the head, to that second."""
    scene, ring = scene_of(name, "wood"), StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    chance, out = np.random.default_rng(1), np.zeros((RATE_HZ // 100, 2), np.float32)
    spent = 0
    for part in range(100):
        at = 10**9 + 10_000_000 * part
        for k in range(STRIKES_PER_S // 100):
            blow = strike_for_speed(
                scene, float(chance.uniform(0.1, 2.0)), *map(float, chance.uniform(-0.7, 0.7, 2))
            )
            ring.push_blow(blow, at + 1_000_000 * k)
        begun = time.thread_time_ns()
        render_all(engine, out, 64, at)
        spent += time.thread_time_ns() - begun
    return spent * 1e-9


def alike() -> float:
    """Correlation of the first 30 ms of two strokes of `tom` at the same speed: the first, and what the second adds."""
    scene = scene_of("tom", "wood")
    scene = dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, gain_dB=-40.0))
    apart = round(APART_S * RATE_HZ)
    first, second = (strike_for_speed(scene, 1.0, 0.5, 0.0, t_s) for t_s in (0.01, 0.01 + apart / RATE_HZ))
    alone = render(scene, [first], 0.2, RATE_HZ)[:, 0].astype(float)
    both = render(scene, [first, second], 0.2, RATE_HZ)[:, 0].astype(float)
    begin, length = round(0.01 * RATE_HZ), round(0.03 * RATE_HZ)
    added = (both - alone)[begin + apart : begin + apart + length]
    return float(np.corrcoef(alone[begin : begin + length], added)[0, 1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=15)
    runs = parser.parse_args().runs
    cases = {
        f"{name}, {words}": step_case(name, material, touches)
        for name in DRUMS
        for words, material, touches in (
            ("strikes", None, False),
            ("no mallet plays", "wood", False),
            ("wood touches", "wood", True),
            ("felt touches", "felt", True),
        )
    }
    spent: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(runs):
        for name, run in cases.items():
            spent[name].append(run())
    cost = {name: statistics.median(values) for name, values in spent.items()}
    result: dict[str, Any] = {
        "runs": runs,
        "step_ns": cost,
        "touch_ns": {
            f"{name}, {tip}": statistics.median(
                many - few
                for many, few in zip(
                    spent[f"{name}, {tip} touches"], spent[f"{name}, no mallet plays"], strict=True
                )
            )
            for name in DRUMS
            for tip in ("wood", "felt")
        },
        "strikes_per_s": STRIKES_PER_S,
        "share_of_a_core": {name: many_strikes(name) for name in DRUMS},
        "correlation_of_two_strokes": alike(),
    }
    print(json.dumps(result, indent=1))
    stored.store("mallet", result)


if __name__ == "__main__":
    main()
