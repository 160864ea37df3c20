"""The pool of mallets: places under the tip, several at once, too many, and none."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.engine import Engine
from drumstick.drum.mallets.mallet import GONE
from drumstick.drum.memory.mallets import MAX_TIP_ROWS, POOL, TIP_LANES
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.drum import Modal
from drumstick.parameters.scene import Scene
from mallets import start_mallet, with_mallet
from realtime.kernels.jit import allocations
from stability.mesh_steps import RATE, drum_of, engine_of, take


def drum(mesh: dict[str, object] | None = None, **numbers: float) -> Scene:
    return with_mallet(drum_of({}, 0.5, 300.0, mesh), **numbers)


def under(engine: Engine, slot: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Junctions under a tip: flat indices and shares."""
    assert engine.mallets is not None
    patches = engine.mallets.patches
    assert patches is not None
    rows = int(patches.rows[slot])
    assert 0 < rows <= MAX_TIP_ROWS
    places: Any = np.add.outer(patches.starts[slot, :rows], np.arange(TIP_LANES))
    return places.ravel(), patches.shares[slot, :rows].ravel().astype(float)


@pytest.mark.daily("place1-*")
@pytest.mark.parametrize("mesh", [{}, {"topology": "rectilinear"}], ids=str)
@pytest.mark.parametrize("radius_m", [0.0005, 0.01, 0.1])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.31, -0.17), (0.9, 0.2), (-1.0, 0.0), (3.0, 3.0)])
def test_shares_under_a_tip_add_up_to_one_about_its_middle(
    mesh: dict[str, object], radius_m: float, place: tuple[float, float]
) -> None:
    engine = engine_of(drum(mesh, tip_radius_m=radius_m))
    start_mallet(engine, 1.0, *place)
    places, shares = under(engine)
    grid = engine.head.grid[0]
    h, stride = float(grid["spacing"]), int(grid["stride"])
    assert shares.sum() == pytest.approx(1.0, rel=1e-6)
    assert (shares >= 0.0).all()
    assert (engine.head.weights[places[shares > 0.0]] > 0.0).all()
    row, column = places // stride - int(grid["centre_row"]), places % stride - int(grid["centre_column"])
    square = "topology" in mesh
    x = (column + (0.0 if square else 0.5) * (row & 1)) * h
    y = row * h * (1.0 if square else math.sqrt(0.75))
    wanted = np.array(place) * min(1.0, (1.0 - h) / max(math.hypot(*place), 1e-9))
    reach = float(engine.mallets.state["radius"][0])  # type: ignore[union-attr]
    assert np.hypot(x - wanted[0], y - wanted[1])[shares > 0.0].max() <= reach * (1.0 + 1e-9)
    if math.hypot(*wanted) + reach < 1.0 - 2.0 * h:  # whole on the head
        assert np.hypot(shares @ x - wanted[0], shares @ y - wanted[1]) < 0.25 * h


def test_a_drum_without_mallets_has_none_of_it() -> None:
    assert engine_of(drum_of({})).mallets is None


def test_a_blow_without_a_speed_never_comes() -> None:
    engine = engine_of(drum())
    for speed in (0.0, -1.0, math.nan):
        start_mallet(engine, speed)
    assert engine.mallets is not None
    assert engine.mallets.state["begun"][0] == 0
    assert take(engine, 100) == 0.0


def test_a_mallet_leaves_when_the_head_has_thrown_it_back_and_then_the_head_falls_asleep() -> None:
    engine = engine_of(drum())
    assert engine.mallets is not None
    start_mallet(engine, 1.0)
    take(engine, 10)
    assert engine.mallets.state["begun"][0] - engine.mallets.state["oldest"][0] == 1
    take(engine, RATE)
    assert engine.mallets.state["begun"][0] == engine.mallets.state["oldest"][0] == 1
    assert (engine.mallets.pool["stage"] == GONE).all()
    take(engine, 2 * RATE)
    assert engine.control["asleep"][0] == 1


def test_mallets_apart_play_together_and_one_in_the_same_place_takes_the_first_away() -> None:
    engine = engine_of(drum())
    assert engine.mallets is not None
    state = engine.mallets.state
    start_mallet(engine, 1.0, 0.5, 0.0)
    start_mallet(engine, 1.0, -0.5, 0.0)
    take(engine, 5)
    assert (engine.mallets.pool["force"][:2] > 0.0).all()
    assert state["lifted"][0] == 0
    start_mallet(engine, 1.0, 0.5, 0.0)
    take(engine, 5)
    assert state["lifted"][0] == 1
    assert (engine.mallets.pool["stage"][:2] != GONE).tolist() == [False, True]


def test_a_full_pool_gives_the_oldest_place_to_the_newest_and_counts() -> None:
    engine = engine_of(drum())
    assert engine.mallets is not None
    for k in range(POOL + 3):
        start_mallet(engine, 1.0, 0.9 * math.cos(k), 0.9 * math.sin(k), -1000.0)
    state = engine.mallets.state[0]
    assert (state["replaced"], state["begun"] - state["oldest"]) == (3, POOL)


def on_modes() -> Scene:
    return dataclasses.replace(drum(), modal=Modal(3000.0))


@pytest.mark.parametrize("drum_of_them", [drum, on_modes])
def test_a_thousand_strikes_a_second_allocate_nothing_and_stay_in_the_pool(
    drum_of_them: Callable[[], Scene],
) -> None:
    scene, ring = drum_of_them(), StrikeRing()
    engine = build(scene, RATE, ring)
    assert engine.mallets is not None
    chance, out = np.random.default_rng(1), np.zeros((480, 2), np.float32)
    render_all(engine, out, 128, 10**9)
    allocated = set[int]()
    for block in range(50):
        for k in range(10):
            at = 10**9 + 10_000_000 * (block + 1) + 1_000_000 * k
            ring.push_blow(
                strike_for_speed(scene, float(chance.uniform(0.1, 3.0)), *chance.uniform(-0.9, 0.9, 2)), at
            )
        before = allocations()
        render_all(engine, out, 128, 10**9 + 10_000_000 * (block + 1))
        allocated.add(allocations() - before)
        assert np.isfinite(out).all()
        assert out.any()
    assert len(allocated) == 1, "what the call from Python costs, whatever is played"
    state = engine.mallets.state[0]
    assert state["begun"] >= 490
    assert state["begun"] - state["oldest"] <= POOL


def test_blocks_of_any_length_play_the_same_samples_at_the_strikes_instant() -> None:
    scene = drum()
    found: list[np.ndarray] = []
    for block in (16, 128, 1000):
        ring = StrikeRing()
        engine = new_engine(scene, RATE, ring)
        engine.control["output_gain"] = 1e-6
        for k, speed in enumerate((1.0, 0.3, 2.0)):
            ring.push_blow(strike_for_speed(scene, speed, 0.3, 0.1 * k), 10**9 + 12_345_678 * (k + 1))
        out = np.zeros((4000, 2), np.float32)
        render_all(engine, out, block, 10**9)
        found.append(out)
    assert found[0].any()
    for other in found[1:]:  # blocks begin at whole nanoseconds
        np.testing.assert_allclose(other, found[0], atol=1e-4 * np.abs(found[0]).max())


@pytest.mark.parametrize("drum_of_them", [drum, on_modes])
def test_the_same_strike_on_a_head_at_rest_is_the_same_to_the_bit(drum_of_them: Callable[[], Scene]) -> None:
    scene = drum_of_them()
    blows = [strike_for_speed(scene, 0.7, 0.4, 0.1, 0.01)]
    np.testing.assert_array_equal(render(scene, blows, 0.1, RATE), render(scene, blows, 0.1, RATE))
