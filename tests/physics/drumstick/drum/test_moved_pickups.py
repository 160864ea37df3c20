"""Pickups that are moved while the drum rings: what they hear then is what the theory says of their new places.

The reference is the ideal membrane's, by Bessel functions: after the move each mode is louder by the ratio of its shape
at the new place to that at the old one.
"""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.special import jn_zeros, jv

from clicks import roughness
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.memory.pickup_fade import FADE_S
from drumstick.drum.render import LiveChange, mixed, parts, render
from drumstick.parameters.drum import Listen, Modal
from drumstick.parameters.scene import Scene

RATE = 48_000
F01_HZ = 150.0
AT = (0.2, 0.3)  # of the strike
OLD, NEW = (0.43, 0.19), (-0.35, 0.4)
SET_S, END_S = 0.2, 1.5
FADE = round(FADE_S * RATE)
# (zero, order) of the first eight modes; a pair counts once.
FIRST = sorted((float(j), m) for m in range(8) for j in jn_zeros(m, 3))[:8]
Sound = npt.NDArray[np.float64]


def scene(renderer: str = "mesh", f01_Hz: float = F01_HZ, **effects: object) -> Scene:
    plain = Scene("drum")
    drum = dataclasses.replace(plain.drum, f01_Hz=f01_Hz, t60_s=3.0, inject="linear", effects=effects)
    listen = Listen(pickups=((*OLD, 0.0),), pickup_places="live")
    modal = Modal(top_Hz=4000.0) if renderer == "modal" else None
    return dataclasses.replace(plain, drum=drum, modal=modal, listen=listen)


def moves(at_s: float, x: float, y: float) -> list[LiveChange]:
    return [LiveChange(at_s, "pickup-1.x", x), LiveChange(at_s, "pickup-1.y", y)]


def heard(which: Scene, *changes: LiveChange, until_s: float = END_S) -> Sound:
    blow = dataclasses.replace(strike_for_speed(which, 0.5, *AT), impulse_N_s=0.0)
    return render(which, [blow], until_s, RATE, changes=changes)[:, 0].astype(float)


def levels(sound: Sound) -> npt.NDArray[np.float64]:
    part = sound[round((SET_S + 0.1) * RATE) :]
    spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)), 8 * len(part)))
    f = np.fft.rfftfreq(8 * len(part), 1.0 / RATE)
    return np.array([spectrum[np.abs(f - F01_HZ * j / FIRST[0][0]) < 3.0].max() for j, _ in FIRST])


def shapes(x: float, y: float) -> npt.NDArray[np.float64]:
    """Shape here, (x, y), of each mode that a blow at AT excites."""
    turned = math.atan2(y, x) - math.atan2(AT[1], AT[0])
    return np.array([jv(m, j * math.hypot(x, y)) * math.cos(m * turned) for j, m in FIRST])


@pytest.mark.parametrize("renderer", ["mesh", "modal"])
@pytest.mark.parametrize("place", [NEW, (0.0, 0.0)])
def test_each_mode_is_louder_by_the_ratio_of_its_shapes(renderer: str, place: tuple[float, float]) -> None:
    which = scene(renderer)
    gained = levels(heard(which, *moves(SET_S, *place))) / levels(heard(which))
    expected = np.abs(shapes(*place) / shapes(*OLD))
    assert gained == pytest.approx(expected, rel=0.06, abs=0.02)
    if place == (0.0, 0.0):  # of all modes with a node line through the middle nothing is left
        assert gained[[m > 0 for _, m in FIRST]].max() < 0.02
        assert gained[[m == 0 for _, m in FIRST]].min() > 0.5


@pytest.mark.parametrize(
    ("renderer", "effects"),
    [
        ("mesh", {}),
        ("modal", {}),
        pytest.param("mesh", {"cavity": CavityTable(), "air": AirTable()}, marks=pytest.mark.long),
        pytest.param("modal", {"air": AirTable()}, marks=pytest.mark.long),
    ],
)
def test_a_crossfade_without_a_click_ends_where_a_pickup_would_have_been_all_the_time(
    renderer: str, effects: dict[str, object]
) -> None:
    which = scene(renderer, 100.0, **effects)
    stays, there = heard(which), heard(which, *moves(0.0, *NEW))
    moved = heard(which, *moves(SET_S, *NEW))
    first = round(SET_S * RATE)
    np.testing.assert_allclose(moved[:first], stays[:first], atol=0.0)
    np.testing.assert_allclose(moved[first + FADE + 400 :], there[first + FADE + 400 :], atol=2e-6)
    during = slice(first - 200, first + FADE + 400)
    assert np.abs(moved[during] - stays[during]).max() > 0.01
    assert roughness(moved[during]) <= 1.5 * max(roughness(stays[during]), roughness(there[during]))


@pytest.mark.parametrize("renderer", ["mesh", "modal"])
def test_reading_elsewhere_gives_nothing_back_to_the_drum(renderer: str) -> None:
    which = scene(renderer)
    back = heard(which, *moves(0.1, 0.0, 0.0), *moves(0.3, *NEW), *moves(0.5, *OLD))
    tail = round(0.6 * RATE)
    np.testing.assert_allclose(back[tail:], heard(which)[tail:], atol=0.0 if renderer == "mesh" else 2e-6)


@pytest.mark.parametrize("renderer", ["mesh", "modal"])
def test_a_stroke_that_wakes_the_drum_right_after_a_move_is_heard_there_whole(renderer: str) -> None:
    which = scene(renderer)
    blow = dataclasses.replace(strike_for_speed(which, 0.5, *AT), t_s=SET_S + 10 / RATE)
    at_once, before = (
        render(which, [blow], 0.4, RATE, changes=moves(at_s, *NEW))
        for at_s in (SET_S, 128 / RATE)  # whole blocks
    )
    np.testing.assert_array_equal(at_once, before)


def test_places_that_are_set_faster_than_a_fade_end_at_the_newest() -> None:
    which = scene()
    hurried = [change for n in range(20) for change in moves(SET_S + 0.005 * n, 0.02 * n, 0.01 * n)]
    tail = round((SET_S + 0.2) * RATE)
    newest = heard(which, *moves(0.0, 0.38, 0.19))
    np.testing.assert_array_equal(heard(which, *hurried)[tail:], newest[tail:])


@pytest.mark.long
@pytest.mark.parametrize("renderer", ["mesh", "modal"])
def test_stems_move_with_the_pickups_and_add_up_to_the_mix(renderer: str) -> None:
    effects = {} if renderer == "modal" else {"cavity": CavityTable(), "air": AirTable()}
    which = scene(renderer, **effects)
    pair = dataclasses.replace(which.listen, pickups=((*OLD, 0.0), (0.5, 0.2, 0.0)))
    which = dataclasses.replace(which, listen=pair)
    changes = moves(SET_S, *NEW)
    blow = strike_for_speed(which, 0.5, *AT)
    apart = np.concatenate(
        [part.copy() for part in parts(which, [blow], 0.6, RATE, changes=changes, stems=True)]
    )
    whole = render(which, [blow], 0.6, RATE, changes=changes)
    assert mixed(apart) == pytest.approx(whole, abs=3e-6)
    there = np.concatenate(
        [part.copy() for part in parts(which, [blow], 0.6, RATE, changes=moves(0.0, *NEW), stems=True)]
    )
    tail = round((SET_S + 0.1) * RATE)
    assert apart[tail:] == pytest.approx(there[tail:], abs=3e-6)
    assert np.abs(apart[: tail // 3, 2:4] - there[: tail // 3, 2:4]).max() > 0.01


def test_a_choke_and_another_pitch_leave_the_pickups_where_they_are() -> None:
    which = scene()
    late = dataclasses.replace(strike_for_speed(which, 0.5, *AT), t_s=1.0)

    def last(at_s: float, pitch: list[LiveChange], chokes: list[float]) -> npt.NDArray[np.float32]:
        changes = [*moves(at_s, *NEW), *pitch]
        return render(which, [late], 1.3, RATE, changes=changes, chokes=chokes)[RATE:]

    for pitch in ([], [LiveChange(0.3, "drum.f01", 200.0)]):
        np.testing.assert_array_equal(last(0.1, pitch, [0.6]), last(0.8, pitch, []))
