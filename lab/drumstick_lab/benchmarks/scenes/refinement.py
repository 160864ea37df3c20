"""Changes on finer and finer meshes of what effects that are not linear come to: drumstick lab refinement.

The same drum and the same stroke in SI on meshes of 12, 24 and 48 kHz: how much changes from each to the next, and the
order that this shows, log2 of the one change over the other. Two is a method of the second order; 0 and less does not
converge. Stores lab/results/refinement.json; docs/measured.md has the table.
"""

import argparse
import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored

RATE_HZ = 48_000
MESHES_HZ = (12_000.0, 24_000.0, 48_000.0)
POLYESTER = TensionTable(young_GPa=3.5, thickness_mm=0.19, poisson=0.35, most_cents=1200.0)
LOOKED_AT_S = np.arange(0.5, 30.0, 0.25) * 1e-3
EDGES_HZ = (500.0, 1000.0, 2500.0, 5000.0, 10_000.0)
PLACE = (0.3, 0.2)
TOP_OF = 2.4  # a mesh of 48 kHz beside modes up to 20 kHz
TIP_M = {False: 0.0, True: 0.004}
TIP = "its force, under a tip of 4 mm on modes up to 5, 10 and 20 kHz"
Series = npt.NDArray[np.float64]


def meshed(scene: Scene, rate_Hz: float) -> Scene:
    """The scene on a mesh of that rate, however much it costs."""
    return dataclasses.replace(
        scene, mesh=dataclasses.replace(scene.mesh, rate_Hz=rate_Hz, cpu_budget=math.inf)
    )


def _drum(rate_Hz: float, **drum: Any) -> Scene:
    scene = Scene("drum")
    return meshed(
        dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, t60_s=0.6, **drum)), rate_Hz
    )


def _at_each_step(engine: Engine, until_s: float, look: Callable[[], float]) -> Series:
    # At LOOKED_AT_S, from what is seen between two steps.
    divisor = int(engine.control["divisor"][0])
    out, rate_Hz = np.zeros((divisor, 2), np.float32), RATE_HZ / divisor
    seen: list[float] = []
    for _ in range(int(rate_Hz * (until_s + 1e-3))):
        render_all(engine, out, divisor, 0)
        seen.append(look())
    return np.interp(LOOKED_AT_S, (np.arange(len(seen)) + 0.5) / rate_Hz, seen)


def _bend(engine: Engine, height: float) -> None:
    # A smooth bump off the centre, at rest; in radii of the head, as the mesh counts.
    grid = engine.head.grid[0]
    spacing, stride = float(grid["spacing"]), int(grid["stride"])
    at = np.arange(engine.head.weights.size)
    row, column = at // stride - int(grid["centre_row"]), at % stride - int(grid["centre_column"])
    x, y = spacing * (column + 0.5 * (row & 1)), spacing * 0.75**0.5 * row
    bump = np.exp(-((x - PLACE[0]) ** 2 + (y - PLACE[1]) ** 2) / 0.1) * np.maximum(1.0 - x * x - y * y, 0.0)
    engine.head.time_levels[:] = height * bump * (engine.head.weights != 0.0)
    engine.control["asleep"] = 0


def rise(rate_Hz: float, struck: bool) -> Series:
    """Rise of the tension, T/T0 - 1, at LOOKED_AT_S of a head with `tension`, struck at a point by a stroke of 2 m/s or let go smoothly."""
    scene, ring = _drum(rate_Hz, effects={"tension": POLYESTER}), StrikeRing()
    engine = new_engine(scene, RATE_HZ, ring)
    if struck:
        ring.push_blow(strike_for_speed(scene, 2.0, *PLACE))
    else:
        _bend(engine, 5.0)
    state, tau = engine.effects.tension.state, float(engine.control["tau"][0])
    return _at_each_step(engine, float(LOOKED_AT_S[-1]), lambda: float(state["pull"][0]) / tau)


def push(rate_Hz: float, on_modes: bool) -> Series:
    """Force of a wooden mallet's blow of 2 m/s at LOOKED_AT_S, N, on a junction of a mesh, or under its tip's disc on a
    bank of modes up to rate_Hz / TOP_OF, which is stepped at the device's rate."""
    scene = dataclasses.replace(
        _drum(rate_Hz, excitation="mallet"), mallet=Mallet(tip_radius_m=TIP_M[on_modes])
    )
    if on_modes:
        scene = dataclasses.replace(scene, modal=Modal(top_Hz=rate_Hz / TOP_OF))
    ring = StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    assert engine.mallets is not None
    pool = engine.mallets.pool
    ring.push_blow(strike_for_speed(scene, 2.0, *PLACE))
    return _at_each_step(engine, float(LOOKED_AT_S[-1]), lambda: float(pool["force"][0]))


def _snare(rate_Hz: float) -> Scene:
    return meshed(parse(shipped_text("snare"), "snare"), rate_Hz)


def stroke(rate_Hz: float) -> Series:
    """Sound of one stroke of `snare` above 1 kHz, 0.3 s of it."""
    scene = _snare(rate_Hz)
    blow = strike_for_speed(scene, 0.3 * scene.strike.full_scale_m_per_s, 0.3, 0.1)
    heard = np.fft.rfft(render(scene, [blow], 0.3, RATE_HZ).astype(float).mean(axis=1))
    heard[: round(1000.0 * 0.3)] = 0.0
    return np.fft.irfft(heard)


def octaves(rate_Hz: float) -> Series:
    """Levels of the bands between EDGES_HZ of `snare`, dB of the whole, means over five dynamics and three places."""
    scene = _snare(rate_Hz)
    found: list[list[float]] = []
    for share, x in itertools.product((0.1, 0.18, 0.32, 0.56, 1.0), (0.15, 0.3, 0.5)):
        blow = strike_for_speed(scene, share * scene.strike.full_scale_m_per_s, x, 0.1)
        power = np.abs(np.fft.rfft(render(scene, [blow], 1.0, RATE_HZ).astype(float).mean(axis=1))) ** 2
        bands = [power[int(low) : int(high)].sum() for low, high in itertools.pairwise(EDGES_HZ)]
        found.append([10.0 * math.log10(band / power[30:].sum()) for band in bands])
    return np.mean(found, axis=0)


def relative(one: Series, finer: Series) -> float:
    """Root mean square of the difference over the finer one's."""
    return float(np.sqrt(np.mean((finer - one) ** 2) / np.mean(finer**2)))


def farthest(one: Series, finer: Series) -> float:
    """The largest difference."""
    return float(np.abs(finer - one).max())


def study(
    effect: str, what: str, unit: str, of: Callable[[float], Series], apart: Callable[[Series, Series], float]
) -> dict[str, Any]:
    """Changes from each mesh to the next, in `unit`, and the order that it shows."""
    found = [of(rate_Hz) for rate_Hz in MESHES_HZ]
    changes = [apart(one, finer) for one, finer in itertools.pairwise(found)]
    return {
        "effect": effect,
        "what": what,
        "unit": unit,
        "changes": changes,
        "order": math.log2(changes[0] / changes[1]),
    }


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    rows = [
        study("tension", "its rise, of a head let go smoothly", "", lambda rate: rise(rate, False), relative),
        study("tension", "its rise, under a blow at a point", "", lambda rate: rise(rate, True), relative),
        study("mallet", "its force, on a point of the mesh", "", lambda rate: push(rate, False), relative),
        study("mallet", TIP, "", lambda rate: push(rate, True), relative),
        study("snare", "a stroke, sample by sample above 1 kHz", "", stroke, relative),
        study("snare", "octaves from 0.5 to 10 kHz, means over strokes", "dB", octaves, farthest),
    ]
    for row in rows:
        print(row)
    stored.store("refinement", {"meshes_Hz": MESHES_HZ, "rows": rows})


if __name__ == "__main__":
    main()
