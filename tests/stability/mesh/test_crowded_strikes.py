"""Strikes one sample apart, by the hundred: linear, so each must be heard whole, as if it had come alone."""

import numpy as np
import pytest

from drumstick.drum.engine import Engine
from stability.catalogue import shows
from stability.mesh_steps import drum_of, engine_of, strike, take

AFTER = 40  # steps after the last onset


def _head(engine: Engine) -> np.ndarray:
    return engine.head.time_levels[int(engine.control["present_level"][0])].astype(np.float64)


def _played(count: int, steps: float, one_at_a_time: bool = False) -> np.ndarray:
    engine = engine_of(drum_of({}, t60_s=0.5))
    for _ in range(count):
        if one_at_a_time:
            engine.control["begun"] = 0  # a drum with one pulse: the next takes the place of the last
        strike(engine, 1.0, steps=steps)
        take(engine, 1)
    take(engine, AFTER)
    return _head(engine)


def _each_alone(count: int, steps: float) -> np.ndarray:
    # One strike, and what the head was like at every step after it: the later ones are the same, only later.
    engine, heads = engine_of(drum_of({}, t60_s=0.5)), list[np.ndarray]()
    strike(engine, 1.0, steps=steps)
    for _ in range(count + AFTER):
        take(engine, 1)
        heads.append(_head(engine))
    return np.sum(heads[AFTER:], axis=0)


@shows("strikes a sample apart")
@pytest.mark.parametrize(("count", "steps"), [(100, 6.0), (300, 30.0), (32, 192.0)])
def test_strikes_a_sample_apart_are_heard_each_as_if_alone(count: int, steps: float) -> None:
    """As many at once as there is room for, 32; they last 0.1, 0.6 and 4 ms."""
    expected = _each_alone(count, steps)
    top = np.max(np.abs(expected))
    assert np.max(np.abs(_played(count, steps) - expected)) < 2e-5 * top
    assert np.max(np.abs(_played(count, steps, one_at_a_time=True) - expected)) > 0.5 * top


@shows("strikes a sample apart", "ours")
def test_of_more_at_once_than_there_is_room_for_the_newest_are_heard() -> None:
    """A hundred contacts of 4 ms in 2 ms, which no stick plays: the oldest end early, and nothing else happens."""
    heard, expected = _played(100, 192.0), _each_alone(100, 192.0)
    assert np.isfinite(heard).all()
    assert 0.1 < np.max(np.abs(heard)) / np.max(np.abs(expected)) < 1.0
