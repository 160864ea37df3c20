"""Microphones in the air: Rayleigh's integral, its delay and its distances, against a plain sum in float64."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.drum import Drum, Listen
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse

RATE = 48_000
RADIUS_M = 0.16


def scene(*microphones: tuple[float, float, float, float]) -> Scene:
    return Scene("drum", drum=Drum(f01_Hz=200.0, radius_m=RADIUS_M), listen=Listen(microphones=microphones))


def places(engine: Engine) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The junctions inside, and x and y of each in radii."""
    grid = engine.head.grid[0]
    inside = np.flatnonzero(engine.head.weights)
    row, column = np.divmod(inside, int(grid["stride"]))
    shift = 0.5 * ((row - int(grid["centre_row"])) & 1)
    h = float(grid["spacing"])
    x = (column - int(grid["centre_column"]) + shift) * h
    return inside, x, (row - int(grid["centre_row"])) * math.sqrt(0.75) * h


def test_it_is_the_sum_over_the_head_each_after_its_way() -> None:
    """The very samples before the interpolator, from the very heights, by another way of summing."""
    where = (0.4, -0.3, 2.5)
    ring = StrikeRing()
    engine = new_engine(scene((*where, -1.0)), RATE, ring)
    ring.push(0, 0.3, 0.2, 1.0, 0.002)
    inside, x, y = places(engine)
    divisor = int(engine.control["divisor"][0])
    distance = np.sqrt((x - where[0]) ** 2 + (y - where[1]) ** 2 + where[2] ** 2)
    late = distance * RADIUS_M / SOUND_M_PER_S * RATE / divisor
    weight = 1.0 / (6.0 * engine.head.weights[inside].astype(float) / float(engine.control["own_gain"][0]))
    steps = 400
    velocity = np.zeros((steps, len(inside)))
    heard = np.zeros(steps)
    before = engine.head.time_levels[int(engine.control["present_level"][0])][inside].astype(float)
    out = np.zeros((divisor, 2), np.float32)
    for k in range(steps):
        render_all(engine, out, divisor, 0)
        now = engine.head.time_levels[int(engine.control["present_level"][0])][inside].astype(float)
        velocity[k], before = now - before, now
        heard[k] = engine.history[0, int(engine.control["history_head"][0])]
    # Each junction's velocity, later by a time that falls between two steps.
    whole = np.floor(late).astype(int)
    flow = np.zeros(steps + whole.max() + 2)
    for k in range(steps):
        np.add.at(flow, k + whole, weight / distance * (1.0 - (late - whole)) * velocity[k])
        np.add.at(flow, k + whole + 1, weight / distance * (late - whole) * velocity[k])
    ideal = np.diff(np.concatenate([[0.0], flow]))[:steps]
    assert np.abs(ideal).max() > 0.0
    assert heard == pytest.approx(ideal, abs=1e-4 * np.abs(ideal).max())


def onset_s(sound: npt.NDArray[np.float32]) -> float:
    level = np.abs(sound).max()
    return float(np.flatnonzero(np.abs(sound) > 0.02 * level)[0]) / RATE


def test_distance_delays_and_weakens() -> None:
    blow = OfflineStrike(0.0, 0.0, 0.0, 5.0, 0.0005)
    far_m, near_m = 20.0 * RADIUS_M, 5.0 * RADIUS_M
    both = render(scene((0.0, 0.0, 5.0, -1.0), (0.0, 0.0, 20.0, 1.0)), [blow], 0.2, RATE)
    delay_s = onset_s(both[:, 1]) - onset_s(both[:, 0])
    assert delay_s == pytest.approx((far_m - near_m) / SOUND_M_PER_S, abs=1e-4)
    near, far = np.sqrt(np.mean(both.astype(np.float64) ** 2, axis=0))  # a peak is where modes happen to meet
    assert near / far == pytest.approx(4.0, rel=0.05)


def test_above_the_middle_only_round_modes_are_heard() -> None:
    """By symmetry; a microphone at the side hears the others too."""
    blow = [OfflineStrike(0.0, 0.6, 0.0, 5.0, 0.001)]
    for x, round_only in ((0.0, True), (3.0, False)):
        sound = render(scene((x, 0.0, 3.0, -1.0)), blow, 1.2, RATE)[RATE // 10 :, 0].astype(float)
        spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound))))
        f = np.fft.rfftfreq(len(sound), 1.0 / RATE)
        first, second = (spectrum[np.abs(f - f_Hz) < 6.0].max() for f_Hz in (200.0, 200.0 * 3.8317 / 2.4048))
        assert (second < 1e-2 * first) == round_only


def test_pickups_are_not_heard_besides_and_a_drum_without_has_none() -> None:
    assert len(new_engine(scene((0.0, 0.0, 2.0, 0.0)), RATE, StrikeRing()).pickups) == 0
    plain = new_engine(dataclasses.replace(scene(), listen=Listen()), RATE, StrikeRing())
    assert plain.microphones is None
    assert len(plain.pickups) > 0


def test_silence_comes_back_and_nothing_stays_on_its_way() -> None:
    ring = StrikeRing()
    short = scene((0.0, 0.0, 40.0, 0.0))
    engine = new_engine(dataclasses.replace(short, drum=Drum(f01_Hz=400.0, t60_s=0.05)), RATE, ring)
    ring.push(0, 0.3, 0.2, 1.0, 0.002)
    out = np.zeros((2 * RATE, 2), np.float32)
    render_all(engine, out, 128, 0)
    assert np.abs(out).max() > 0.0
    assert engine.microphones is not None
    assert not engine.microphones.line.any()
    assert engine.control["asleep"][0] == 1


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("[[0, 0, 0.05, 0]]", "number 1 is 0.05 radii above the head, less than 0.1"),
        ("[[0, 0, 1, 0], [0, 0, 1, 1.5]]", "number 2 has the pan 1.5, outside -1 .. 1"),
        ("[[0, 0, 60, 0]]", "60 of the radius; pan -1 left .. 1 right is outside -50 .. 50"),
        ("3", "3 must be a list of 0 to 16 rows of 4 numbers"),
    ],
)
def test_what_no_microphone_can_be_is_refused(rows: str, words: str) -> None:
    with pytest.raises(SceneError, match=r"a:2: listen\.microphones: ") as refused:
        parse(f"[listen]\nmicrophones = {rows}\n", "a")
    assert words in str(refused.value)


def test_microphones_survive_the_wire() -> None:
    kept = scene((0.0, 1.0, 2.0, 0.5))
    assert from_tables(as_tables(kept)) == kept
    assert from_tables(as_tables(Scene("plain"))) == Scene("plain")
