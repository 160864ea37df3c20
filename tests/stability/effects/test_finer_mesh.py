"""A tension and wires on finer and finer meshes, with the same drum and the same blow in SI: what converges."""

import itertools

import numpy as np
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from realtime.records import is_there
from stability.catalogue import shows
from stability.mesh_steps import RATE, drum_of, strike, take

POLYESTER = TensionTable(young_GPa=3.5, thickness_mm=0.19, poisson=0.35, most_cents=1200.0)
RATES_HZ = (12_000.0, 24_000.0, 48_000.0)
LOOKED_AT_S = np.arange(0.5, 30.0, 0.25) * 1e-3
CONTACT_S = 0.004


def _bend(engine: Engine, height: float) -> None:
    """A smooth bump off the centre, at rest."""
    grid = engine.head.grid[0]
    spacing, stride = float(grid["spacing"]), int(grid["stride"])
    at = np.arange(engine.head.weights.size)
    row, column = at // stride - int(grid["centre_row"]), at % stride - int(grid["centre_column"])
    x, y = spacing * (column + 0.5 * (row & 1)), spacing * 0.75**0.5 * row
    bump = np.exp(-((x - 0.3) ** 2 + (y - 0.2) ** 2) / 0.1) * np.maximum(1.0 - x * x - y * y, 0.0)
    engine.head.time_levels[:] = height * bump * (engine.head.weights != 0.0)


def _rises(rate_Hz: float, struck: bool) -> tuple[np.ndarray, float]:
    """T/T0 - 1 at LOOKED_AT_S of a head that is struck at a point or let go, and its largest displacement."""
    scene = drum_of({"tension": POLYESTER}, t60_s=0.6, f01_Hz=150.0, mesh={"rate_Hz": rate_Hz})
    engine = new_engine(scene, RATE, StrikeRing())
    engine.control["asleep"] = 0
    assert is_there(engine.effects.tension)
    state, rate = engine.effects.tension.state, RATE / float(engine.control["divisor"][0])
    if struck:
        strike(engine, 20.0, steps=rate * CONTACT_S)
    else:
        _bend(engine, 5.0)
    pulls, top = list[float](), 0.0
    for _ in range(int(rate * (LOOKED_AT_S[-1] + 1e-3))):
        take(engine, 1)
        pulls.append(float(state["pull"][0]) / float(engine.control["tau"][0]))
        top = max(top, float(np.abs(engine.head.time_levels).max()))
    # A pull stands between two steps.
    return np.interp(LOOKED_AT_S, (np.arange(len(pulls)) + 0.5) / rate, pulls), top


@shows("tension on a finer mesh")
def test_a_tension_converges_by_the_second_order_and_under_a_point_force_it_does_not() -> None:
    """At a point force a membrane has no height: what bends there grows with the logarithm of the spacing."""
    changes: dict[bool, list[float]] = {}
    for struck in (False, True):
        found = [_rises(rate_Hz, struck) for rate_Hz in RATES_HZ]
        changes[struck] = [float(np.sqrt(np.mean((b[0] - a[0]) ** 2))) for a, b in itertools.pairwise(found)]
        if struck:
            tops = [top for _, top in found]
            assert tops[2] - tops[1] == pytest.approx(tops[1] - tops[0], rel=0.05)  # by as much each time
            assert tops[1] > 1.1 * tops[0]
    assert changes[False][0] / changes[False][1] == pytest.approx(4.0, rel=0.15)
    assert changes[True][1] > 0.9 * changes[True][0]
