"""Theory of the roll that is played, with the servo's own values."""

import numpy as np
import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from web_panel.computing.theory import live_law, theory_of
from web_panel.computing.tick_costs import ticks_of


def scene(name: str = "roll") -> Scene:
    return parse(shipped_text(name), name)


def test_the_default_roll_is_where_the_reference_has_it() -> None:
    """v_E 0.628 m/s; the map runs through its own fixed point, and the way up ends at that speed."""
    found = theory_of(scene(), {})
    assert found.stable == (pytest.approx([0.628], abs=5e-4), pytest.approx([0.628], abs=5e-4))
    v_e = found.stable[0][0]
    assert np.interp(v_e, *found.mapped) == pytest.approx(v_e, rel=1e-3)
    z_mm, v = (np.array(column) for column in found.rising)
    assert np.all(np.diff(z_mm) >= 0.0)
    assert np.all(v >= 0.0)
    assert z_mm[0] < 0.0 < z_mm[-1]
    assert np.all(np.array(found.falling[1]) < 0.0)


def test_the_servos_values_count_not_the_scenes() -> None:
    found = theory_of(scene(), {"dv_pls": 0.4, "z_h0": 5.0, "unknown": 1.0})
    assert found.stable[0][0] > 0.8
    assert live_law(scene(), {"k_coll": 4000.0})["k_coll"][0] == 4000.0
    with pytest.raises(Refusal):
        live_law(scene(), {"k_coll": -1.0})


def test_stable_ends_in_words() -> None:
    """`roll` is broken by a strike that the hand keeps in the head; nothing breaks `paper-roll`."""
    assert theory_of(scene(), {}).ends == (
        "2 stable ends: a strike decides which. A strike below 0.0549 m/s (now 0.559) breaks the roll."
    )
    assert theory_of(scene("paper-roll"), {}).ends == "One stable end: every strike leads to it."


def test_a_motion_that_never_repeats_has_no_map() -> None:
    with pytest.raises(ValueError, match="with system_delay the motion never repeats"):
        theory_of(scene("delay-drum"), {})


def test_ticks_are_timed_with_all_effects_with_none_and_with_the_scenes_own() -> None:
    found = ticks_of(scene())
    assert set(found.ns) == {"all", "none", "pulse"}
    assert all(ns > 0.0 for ns in found.ns.values())
    assert found.rate_Hz == 1000
