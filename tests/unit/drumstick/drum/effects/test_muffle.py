"""The muffle: pressed by nothing it is not there, and it moves to what is wanted without a mallet feeling it."""

import itertools

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.memory.strikes import StrikeRing
from mallets import start_mallet, with_mallet
from stability.mesh_steps import RATE, drum_of, engine_of, strike, take

PATCHES = ((0.4, 0.1, 0.4), (0.9, 0.0, 0.3))
MORE: dict[str, dict[str, object]] = {
    "alone": {},
    "with others": {"tension": TensionTable(600.0), "internal_loss": InternalLossTable(0.05, 4000.0)},
}


def _engine(press: float | None, more: dict[str, object]) -> Engine:
    muffle: dict[str, object] = {} if press is None else {"muffle": MuffleTable(PATCHES, 0.005, press)}
    return engine_of(drum_of(muffle | more, 60.0, 2000.0))


def _press(engine: Engine) -> float:
    return float(engine.effects.muffle.state["press"][0])


def _heads_after_a_stroke(engine: Engine, steps: int = 300) -> np.ndarray:
    strike(engine, 5.0, 0.4, 0.1)
    take(engine, steps)
    return engine.head.time_levels.copy()


@pytest.mark.parametrize("name", MORE)
def test_a_patch_that_nobody_presses_is_not_there(name: str) -> None:
    np.testing.assert_array_equal(
        _heads_after_a_stroke(_engine(0.0, MORE[name])), _heads_after_a_stroke(_engine(None, MORE[name]))
    )


@pytest.mark.parametrize("name", MORE)
def test_where_it_was_set_to_it_is_as_if_the_scene_had_said_so(name: str) -> None:
    moved, as_written = _engine(1.0, MORE[name]), _engine(0.3, MORE[name])
    set_live(moved, "muffle", 0.3)
    for engine in (moved, as_written):
        take(engine, 5000)
    assert _press(moved) == 0.3
    np.testing.assert_allclose(
        _heads_after_a_stroke(moved), _heads_after_a_stroke(as_written), rtol=0.0, atol=1e-12
    )
    assert not np.array_equal(_heads_after_a_stroke(_engine(1.0, MORE[name])), moved.head.time_levels)


def test_it_goes_the_whole_way_in_twenty_milliseconds_and_never_beyond() -> None:
    engine = _engine(1.0, {})
    steps = round(0.02 / engine.control["divisor"][0] * engine.control["rate_Hz"][0])
    set_live(engine, "muffle", 0.0)
    seen = [_press(engine)]
    for _ in range(steps + 2):
        take(engine, 1)
        seen.append(_press(engine))
    assert seen == sorted(seen, reverse=True)
    assert seen[-1] == 0.0 < seen[steps - 5]
    assert max(before - after for before, after in itertools.pairwise(seen)) <= 1.0 / steps + 1e-9


def test_it_waits_until_the_tip_is_out_of_the_head_and_the_tip_knows() -> None:
    engine = engine_of(with_mallet(drum_of({"muffle": MuffleTable(PATCHES, 0.005)}, 60.0, 2000.0)))
    start_mallet(engine, 1.0, 0.4, 0.1)
    take(engine, 2)
    slot = int(engine.mallets.state["oldest"][0])
    set_live(engine, "muffle", 0.5)
    touching = 0
    while engine.mallets.tips["depth"][slot] > 0.0 or touching == 0:
        assert _press(engine) == 1.0
        before = float(engine.mallets.tips["compliance"][slot])
        take(engine, 1)
        touching += 1
        assert touching < 20_000
    assert touching > 5
    take(engine, 3)
    assert _press(engine) < 1.0
    assert engine.mallets.tips["compliance"][slot] > before  # less is held under it


def test_it_moves_through_the_densest_roll() -> None:
    """A stroke every ten milliseconds, so that some mallet is always on its way."""
    engine = engine_of(with_mallet(drum_of({"muffle": MuffleTable(PATCHES, 0.005)}, 60.0, 400.0)))
    step_s = float(engine.control["divisor"][0] / engine.control["rate_Hz"][0])
    set_live(engine, "muffle", 0.0)
    for stroke in range(60):
        start_mallet(engine, 1.0, 0.5 * float(np.cos(stroke)), 0.5 * float(np.sin(stroke)))
        take(engine, round(0.01 / step_s))
    assert _press(engine) == 0.0


@pytest.mark.parametrize("excitation", ["analytic", "mallet"])
def test_what_is_set_while_nothing_sounds_holds_for_the_first_stroke_from_its_beginning(
    excitation: str,
) -> None:
    def heard(press: float, then_set: float) -> np.ndarray:
        ring, scene = StrikeRing(), drum_of({"muffle": MuffleTable(PATCHES, 0.005, press)}, 1.0, 400.0)
        engine = new_engine(scene if excitation == "analytic" else with_mallet(scene), RATE, ring)
        out = np.zeros((RATE // 5, 2), np.float32)
        render_all(engine, out[: RATE // 50], 64, 0)  # silence, in which it is not computed
        set_live(engine, "muffle", then_set)
        ring.push(0, 0.3, 0.2, 5.0, 0.002, 0.0, 1.0)
        render_all(engine, out, 64, 0)
        return out

    wanted, other = heard(0.2, 0.2), heard(1.0, 1.0)
    np.testing.assert_array_equal(heard(1.0, 0.2), wanted)
    assert np.abs(wanted - other).max() > 0.01 * np.abs(wanted).max() > 0.0


def test_what_a_drum_does_not_have_is_not_set() -> None:
    engine = _engine(1.0, {})
    set_live(engine, "dv_pls", 0.5)
    assert engine.effects.muffle.target["muffle"][0] == 1.0
