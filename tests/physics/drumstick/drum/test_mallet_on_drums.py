"""Mallets on drums: how long they touch, how bright they are, and that no two strokes are the same."""

import dataclasses

import numpy as np
import pytest

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from mallets import touched_s
from published import DRUMS

RATE = 48_000
DYNAMICS = (0.05, 0.2, 1.0, 2.0)  # m/s, up to full scale
TOM = """
[drum]
excitation = "mallet"
radius_m = 0.165
f01_Hz = 110.0
t60_s = 1.4
inject = "linear"

[drum.effects.internal_loss]
t60_s = 0.12
at_Hz = 2000.0

[drum.effects.tension]
glide_cents = 80.0

[drum.effects.cavity]
depth_m = 0.3
head_kg_per_m2 = 0.26
f01_Hz = 140.0
t60_s = 1.0
heard = 0.5

[mesh]
accuracy = "standard"
"""


def tom(material: str) -> Scene:
    scene = parse(f'{TOM}\n[mallet]\nmaterial = "{material}"\n', "tom")
    return dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, gain_dB=-40.0))  # not limited


@pytest.mark.parametrize("x", [0.0, 0.3, 0.5, 0.7])
def test_wood_touches_a_tom_for_three_to_six_milliseconds(x: float) -> None:
    times = [touched_s(tom("wood"), speed, x) for speed in DYNAMICS]
    shortest, longest = DRUMS["contact"]["wagner_s"]
    assert min(times) >= shortest
    assert max(times) <= longest


# Contact on the shipped toms, ms, by place (of the radius): soft (a tenth of full scale) and hard (full scale).
SHIPPED_MS = {
    "high-tom": {0.0: (7.8, 5.6), 0.3: (7.0, 4.7), 0.5: (6.5, 4.4), 0.7: (6.1, 4.1), 0.9: (5.2, 3.5)},
    "mid-tom": {0.0: (8.1, 5.5), 0.3: (7.2, 4.8), 0.5: (6.8, 4.7), 0.7: (6.5, 4.4), 0.9: (5.5, 3.7)},
    "low-tom": {0.0: (7.0, 5.1), 0.3: (7.8, 5.4), 0.5: (8.0, 5.6), 0.7: (7.6, 5.4), 0.9: (6.5, 4.6)},
    "tom": {0.0: (7.3, 5.3), 0.3: (7.0, 5.2), 0.5: (7.2, 5.2), 0.7: (6.8, 4.8), 0.9: (6.2, 4.1)},
}


@pytest.mark.parametrize("name", SHIPPED_MS)
def test_the_shipped_toms_are_touched_as_long_as_published_by_hard_strokes_and_longer_by_soft_ones(
    name: str,
) -> None:
    """Soft strokes stay outside Wagner's 3 to 6 ms but for the rim of two (reference/README.md); so these are held."""
    scene = parse(shipped_text(name), name)
    full = scene.strike.full_scale_m_per_s
    shortest, longest = DRUMS["contact"]["wagner_s"]
    for x, soft_and_hard_ms in SHIPPED_MS[name].items():
        soft, hard = (touched_s(scene, share * full, x) for share in (0.1, 1.0))
        assert shortest <= hard <= longest, x
        assert [1e3 * soft, 1e3 * hard] == pytest.approx(soft_and_hard_ms, rel=0.04), x


def _centroid(sound: np.ndarray) -> float:
    # Of the magnitudes of the first 10 ms, faded out so that their end is not heard.
    begin = int(np.flatnonzero(np.abs(sound) > 1e-3 * np.abs(sound).max())[0])
    length = RATE // 100
    part = sound[begin : begin + length].astype(float) * np.hanning(2 * length)[length:]
    size = np.abs(np.fft.rfft(part, 4096))
    return float(np.sum(np.fft.rfftfreq(4096, 1.0 / RATE) * size) / np.sum(size))


def test_felt_is_an_octave_brighter_when_it_strikes_hard() -> None:
    scene = tom("felt")
    soft, hard = (
        _centroid(render(scene, [strike_for_speed(scene, speed, 0.5, 0.0, 0.01)], 0.05, RATE)[:, 0])
        for speed in (DYNAMICS[0], DYNAMICS[-1])
    )
    assert hard > 2.0 * soft


def test_two_strokes_of_a_roll_at_the_same_speed_differ() -> None:
    """43 ms apart: what the second adds is not what the first was. On a head at rest it is, to the bit."""
    scene = tom("wood")
    apart = round(0.043 * RATE)
    first, second = (strike_for_speed(scene, 1.0, 0.5, 0.0, t_s) for t_s in (0.01, 0.01 + apart / RATE))
    alone = render(scene, [first], 0.2, RATE)[:, 0].astype(float)
    both = render(scene, [first, second], 0.2, RATE)[:, 0].astype(float)
    begin, length = round(0.01 * RATE), round(0.03 * RATE)
    stroke = alone[begin : begin + length]
    added = (both - alone)[begin + apart : begin + apart + length]
    correlation = float(np.corrcoef(stroke, added)[0, 1])
    print(f"correlation of two strokes' first 30 ms: {correlation:.6f}")
    assert 0.5 < correlation < 1.0 - 1e-4
    assert np.array_equal(render(scene, [first], 0.2, RATE)[:, 0].astype(float), alone)


def _below_500_Hz(sound: np.ndarray) -> float:  # noqa: N802
    # Of all energy.
    power = np.abs(np.fft.rfft(sound.astype(float))) ** 2
    return float(power[: round(500.0 * len(sound) / RATE)].sum() / power.sum())


def test_a_cross_stick_is_the_hoop_and_a_stroke_in_the_middle_the_head() -> None:
    """The hoop's modes begin at 900 Hz; the head under a resting hand sounds below 500 Hz."""
    scene = parse(shipped_text("cross-stick"), "cross-stick")
    assert scene.mallet is not None
    shaft, tip = (
        render(scene, [strike_for_speed(scene, 1.0, x, 0.0)], 0.5, RATE)[:, 0]
        for x in (scene.hand.orbit_radius, 0.0)
    )
    assert _below_500_Hz(shaft) < 0.05
    assert _below_500_Hz(tip) > 0.7
    assert np.abs(shaft).max() > 0.1
