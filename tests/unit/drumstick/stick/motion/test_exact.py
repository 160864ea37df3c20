"""`advance` cut into ticks gives the same events as in one go; a horizon is never an event."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact

SCENES: dict[str, Scene] = {name: parse(shipped_text(name), name) for name in shipped_names()}
SCENES |= {row["case"]: stick_cases.cycle_scene(row) for row in stick_cases.rows("limit_cycles.csv")}
SCENES["bare"] = stick_cases.scene(Stick())
DURATION_S = 0.6


def _whole(scene: Scene) -> list[tuple[int, float, float, float]]:
    return stick_cases.events(law_of(scene), thrown(scene, 0.4), DURATION_S)


def _assert_same(
    cut: list[tuple[int, float, float, float]], whole: list[tuple[int, float, float, float]]
) -> None:
    # A tick may notice sooner that the stick has come to rest: before the last turn in the head.
    assert len(whole) - 1 <= len(cut) <= len(whole)
    whole = whole[: len(cut)]
    assert [event for event, *_ in cut] == [event for event, *_ in whole]
    numbers = np.array([row[1:] for row in cut])
    np.testing.assert_allclose(numbers, np.array([row[1:] for row in whole]), rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("tick_s", [1e-3, 0.25e-3, 0.0137])
@pytest.mark.parametrize("name", SCENES)
def test_ticks_change_nothing(name: str, tick_s: float) -> None:
    scene = SCENES[name]
    whole = _whole(scene)
    assert len(whole) >= 4
    _assert_same(stick_cases.events(law_of(scene), thrown(scene, 0.4), DURATION_S, tick_s), whole)


@given(st.floats(2e-5, 0.5))
def test_any_tick_changes_nothing(tick_s: float) -> None:
    scene = SCENES["roll"]
    _assert_same(stick_cases.events(law_of(scene), thrown(scene, 0.4), DURATION_S, tick_s), _whole(scene))


def test_a_tick_that_ends_on_the_event_itself() -> None:
    """Stopping exactly at the instant of an event, the next call reports it, once."""
    scene = SCENES["roll"]
    for event, t, _, _ in _whole(scene)[:12]:
        law, motion = law_of(scene), thrown(scene, 0.4)
        stick_cases.advance_by(law, motion, np.nextafter(t, 0.0))
        after = [e for e, *_ in stick_cases.events(law, motion, 1e-9)]
        assert after.count(event) <= 1
        law, motion = law_of(scene), thrown(scene, 0.4)
        kinds = [e for e, *_ in stick_cases.events(law, motion, float(np.nextafter(t, 1.0)))]
        kinds += [e for e, *_ in stick_cases.events(law, motion, DURATION_S - t)]
        assert kinds == [e for e, *_ in _whole(scene)]


def test_a_contact_goes_entry_turn_release_apex() -> None:
    kinds = [event for event, *_ in _whole(SCENES["roll"])]
    assert kinds[:5] == [exact.APEX, exact.ENTRY, exact.TURN, exact.RELEASE, exact.APEX]


def test_peak_and_depth_are_those_of_the_motion_itself() -> None:
    """peak_N and z_min of a contact against the motion sampled 20000 times inside it."""
    scene = SCENES["A_stick_X_force"]
    law, motion = law_of(scene), thrown(scene, -1.0)
    stick = scene.stick
    step, forces, depths = 5e-7, [0.0], [0.0]
    while not forces[1:] or motion["contact_phase"][0] != exact.ABOVE:
        stick_cases.advance_by(law, motion, step)
        z, v = float(motion["z"][0]), float(motion["v"][0])
        if motion["contact_phase"][0] == exact.CONTACT:
            forces.append(-stick.k_coll_N_per_m * z - (stick.r_in_N_s_per_m - stick.r_out_N_s_per_m) * v)
        depths.append(z)
    assert motion["peak_N"][0] >= max(forces)
    assert motion["peak_N"][0] == pytest.approx(max(forces), rel=1e-6)
    assert motion["z_min"][0] <= min(depths)
    assert motion["z_min"][0] == pytest.approx(min(depths), rel=1e-6)
    assert motion["impulse_N_s"][0] == pytest.approx(sum(forces) * step, rel=1e-3)


def test_overlap_says_what_a_second_pulse_does_to_the_first() -> None:
    """Just after the second exit: `add` has both pulses, `replace` the new one, `ignore` what is left of the first."""
    kick = 1.0 / 0.05
    for overlap in ("add", "replace", "ignore"):
        scene = stick_cases.scene(stick_cases.STICK_A, Pulse(1.0, 0.05, "exit", 1, overlap))
        law, motion = law_of(scene), thrown(scene, 0.4)
        exits: list[float] = []
        t = 0.0
        while len(exits) < 2:
            event, moved = exact.advance(law[0], motion[0], 1.0)
            t += moved
            if event == exact.RELEASE:
                exits.append(t)
        rest = kick * np.exp(-(exits[1] - exits[0]) / 0.05)
        expected = {"add": kick + rest, "replace": kick, "ignore": rest}[overlap]
        assert rest > 0.1 * kick
        assert motion["pulse"]["acceleration"][0] == pytest.approx(expected, rel=1e-12)


def test_an_effect_that_the_scene_does_not_name_has_no_field() -> None:
    bare, pulsed = stick_cases.scene(Stick()), SCENES["roll"]
    for make in (law_of, lambda scene: thrown(scene, 0.4)):
        assert "pulse" not in (make(bare).dtype.names or ())
        assert "pulse" in (make(pulsed).dtype.names or ())
        assert make(bare).dtype.itemsize < make(pulsed).dtype.itemsize
