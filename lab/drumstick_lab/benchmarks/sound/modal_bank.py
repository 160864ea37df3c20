"""Cost of a mode: drumstick lab modal-bank [--rounds 40].

A bank of modes that rings, two pulses on it or none, steps in blocks and one by one: by turns, in windows of a few
milliseconds, of each the least CPU time of the thread. Both must sound alike, or the script stops. Blocks of 128 steps;
without what follows a step, as the interpolation to the device's rate. Then one bank as the shipped toms play: under
`tension`, and while a mallet is pressed in (a kilogram, so that it stays). Where this processor has AVX-512, all once
more in a process that is compiled without it, for AVX2.
"""

import argparse
import dataclasses
import json
import math
import os
import subprocess
import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine, size_of
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.excitation.analytic import begin
from drumstick.drum.membrane.simd import WIDTH
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.bank import set_strike_weights
from drumstick.drum.step import step
from drumstick.parameters.drum import Listen, Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.timing import spent_ns
from drumstick_lab.measuring import stored
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit

RATE_HZ, BLOCK = 48_000, 128
CASES = ((150.0, 5_000.0, False), (150.0, 10_000.0, False), (150.0, 10_000.0, True), (100.0, 20_000.0, False))
COUPLED = (150.0, 10_000.0)  # f01 and top of the bank under tension and a mallet
_MICROPHONES = ((0.3, 0.0, 1.0, 0.5), (-0.3, 0.0, 1.0, -0.5))  # x, y, height in radii; pan
_WINDOW_UPDATES = 4e6
_LONG = 1e9  # steps: a pulse that lasts
_AVX2 = {
    "NUMBA_CPU_NAME": "haswell",
    "NUMBA_CPU_FEATURES": "+avx2,+avx,+fma,+f16c,+bmi,+bmi2,+popcnt,+sse4.2",
}


@njit()
def _stepped(engine: Engine, heard: npt.NDArray[np.float64]) -> None:
    lent, mode, steps = borrowed_view(engine), flush_denormals(), heard.shape[0]
    for n in range(steps):
        heard[n, 0], heard[n, 1] = step(lent, min(BLOCK - n % BLOCK, steps - n))
    restore(mode)


@njit()
def _placed(engine: Engine, row: int, x: float, y: float) -> None:
    set_strike_weights(borrowed_view(engine), row, x, y)


def _engines(scene: Scene) -> dict[str, Engine]:
    # At rest and awake.
    found: dict[str, Engine] = {}
    for name in ("in_blocks", "one_by_one"):
        engine = new_engine(scene, RATE_HZ, StrikeRing())
        engine.control["asleep"] = 0
        found[name] = engine if name == "in_blocks" else engine._replace(blocks=None)
    return found


def _ringing(engine: Engine, pulses: int) -> None:
    chance, size = np.random.default_rng(1), size_of(engine)
    engine.modal.q[:size] = 1e-3 * chance.standard_normal(size)
    engine.modal.d[:size] = 1e-4 * chance.standard_normal(size)
    engine.pulses["age"], engine.control["begun"] = 1.0, 0
    for row in range(pulses):
        _placed(engine, row, 0.3, 0.1 + 0.4 * row)
        engine.control["begun"] = begin(engine.pulses, row, 0.3, 0.1, 0.0, _LONG, 1.0)


def measured(f01_Hz: float, top_Hz: float, has_microphones: bool, rounds: int) -> dict[str, Any]:
    scene = Scene("drum", modal=Modal(top_Hz))
    drum = dataclasses.replace(scene.drum, f01_Hz=f01_Hz, t60_s=20.0)
    listen = Listen(microphones=_MICROPHONES if has_microphones else ())
    engines = _engines(dataclasses.replace(scene, drum=drum, listen=listen))
    modes = size_of(engines["in_blocks"])
    steps = max(2 * BLOCK, round(_WINDOW_UPDATES / modes) // BLOCK * BLOCK)
    row: dict[str, Any] = {
        "f01_Hz": f01_Hz,
        "top_Hz": top_Hz,
        "modes": modes,
        "hears": "microphones" if has_microphones else "pickups",
    }
    for pulses in (0, 2):
        heard = {name: np.zeros((steps, 2)) for name in engines}
        best = dict.fromkeys(engines, math.inf)
        for _ in range(1 + rounds):
            for name, engine in engines.items():
                _ringing(engine, pulses)
                spent = spent_ns(lambda engine=engine, out=heard[name]: _stepped(engine, out))
                best[name] = min(best[name], spent / steps / modes)
        largest = float(np.abs(heard["one_by_one"]).max())
        assert np.abs(heard["in_blocks"] - heard["one_by_one"]).max() < 1e-4 * largest
        row["pulses" if pulses else "ns"] = {**best, "ratio": best["one_by_one"] / best["in_blocks"]}
    return row


def coupled(has_tension: bool, has_mallet: bool, rounds: int) -> dict[str, Any]:
    """ns for each mode and step of one bank that rings after a blow, or while its mallet is pressed in."""
    f01_Hz, top_Hz = COUPLED
    effects = {"tension": TensionTable()} if has_tension else {}
    scene = Scene("drum", modal=Modal(top_Hz))
    excitation = "mallet" if has_mallet else "analytic"
    drum = dataclasses.replace(scene.drum, f01_Hz=f01_Hz, t60_s=20.0, effects=effects, excitation=excitation)
    scene = dataclasses.replace(scene, drum=drum, mallet=Mallet(mass_kg=1.0) if has_mallet else None)
    ring = StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    modes = size_of(engine)
    heard = np.zeros((max(2 * BLOCK, round(_WINDOW_UPDATES / 4 / modes) // BLOCK * BLOCK), 2))
    before, after = (
        np.zeros((BLOCK if has_mallet else RATE_HZ // 4, 2), np.float32),
        np.zeros((RATE_HZ, 2), np.float32),
    )
    best = math.inf
    for _ in range(1 + rounds):
        ring.push_blow(strike_for_speed(scene, 1.0, 0.3, 0.0))
        render_all(engine, before, BLOCK, 10**9)
        best = min(best, spent_ns(lambda: _stepped(engine, heard)) / len(heard) / modes)
        if engine.mallets is not None:
            assert bool((engine.mallets.pool["force"] > 0.0).any()), "it left meanwhile"
            render_all(engine, after, BLOCK, 10**9)  # it leaves
    assert heard.any()
    return {
        "f01_Hz": f01_Hz, "top_Hz": top_Hz, "modes": modes, "tension": has_tension, "mallet": has_mallet, "ns": best,
    }  # fmt: skip


def _all_coupled(rounds: int) -> list[dict[str, Any]]:
    return [coupled(tension, mallet, rounds) for tension in (False, True) for mallet in (False, True)]


def _without_avx512(rounds: int) -> dict[str, list[dict[str, Any]]]:
    command = [
        sys.executable,
        "-m",
        "drumstick_lab.benchmarks.sound.modal_bank",
        "--rows",
        "--rounds",
        str(rounds),
    ]
    found = subprocess.run(command, env=os.environ | _AVX2, capture_output=True, text=True, check=True)
    return json.loads(found.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument(
        "--rows", action="store_true", help="print the rows of this processor and store nothing"
    )
    arguments = parser.parse_args()
    rows, both = [measured(*case, arguments.rounds) for case in CASES], _all_coupled(arguments.rounds)
    if arguments.rows:
        print(json.dumps({"lanes": rows, "coupled": both}))
        return
    lanes, played = {str(WIDTH): rows}, {str(WIDTH): both}
    if WIDTH == 16:
        without = _without_avx512(arguments.rounds)
        lanes["8"], played["8"] = without["lanes"], without["coupled"]
    result = {"rounds": arguments.rounds, "block": BLOCK, "lanes": lanes, "coupled": played}
    print(json.dumps(result, indent=1))
    stored.store("modal_bank", result)


if __name__ == "__main__":
    main()
