"""Announced contacts beside the real ones: the same stick, played on."""

import math

import numpy as np
import pytest

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick import contact
from drumstick.stick.contact_ahead import PredictedContact, contact_ahead, isolated
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from haptic_server.records import RELEASE, STRIKE
from haptic_server.servo import loop
from stability.catalogue import shows

SHIPPED = (
    "bare-drum", "cor-roll", "cross-stick", "delay-drum", "paper-roll", "phantom", "rejected-by-the-paper", "roll",
    "snare", "timpani", "tom",
)  # fmt: skip
CHANGED = {
    "pulses at entry that outlast the contact": '[effects.pulse]\ndv_m_per_s = 0.05\ntau_s = 0.02\ntrigger = "entry"',
    "a spring that pushes more on the way out": "[effects.hysteretic_spring]\nratio = 1.2",
    "a head that gives energy": "[effects.negative_damping]\nr_N_s_per_m = 0.2",
    "a random force": "[effects.noise]\nforce_N = 0.2",
    "a chaotic force": "[effects.chaos]\nforce_N = 0.2",
}
STICK = """
[stick]
m_kg = 0.0045
k_coll_N_per_m = 1500.0
r_in_N_s_per_m = 0.6
k_hand_N_per_m = 4.0
r_out_N_s_per_m = 0.01
z_ss_m = -0.005
"""


def _announced_and_real(scene: Scene, contacts: int) -> tuple[list[PredictedContact], list[PredictedContact]]:
    """Announcements and contacts of a stick that is thrown, as long as it plays."""
    law, motion = law_of(scene), thrown(scene, scene.hand.throw_m_per_s)
    stick, ahead = motion[0], motion.copy()
    announced: list[PredictedContact] = []
    real: list[PredictedContact] = []
    for _ in range(500):  # events: a stick that lies in the head may turn for ever
        if len(real) == contacts or stick["outcome"] != exact.MOVING:
            break
        what, _ = exact.advance(law[0], stick, 1.0)
        if what == exact.ENTRY:
            announced.append(contact_ahead(law[0], stick, ahead))
        elif what == exact.RELEASE:
            real.append(PredictedContact(*(float(stick[name]) for name in PredictedContact._fields)))
    return announced[: len(real)], real


def _arms_contacts(scene: Scene, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Strikes and releases of the contacts that an arm ended by itself, one to one."""
    servo = sampled_arm.servo_of(scene)
    loop.run_virtual(servo, round(seconds * 1e9 / int(servo.plan["period_ns"][0])), 0)
    events = sampled_arm.events_of(servo)
    strikes, releases = events[events["kind"] == STRIKE], events[events["kind"] == RELEASE]
    releases = releases[releases["speed_m_per_s"] > 0.0]
    return strikes[np.isin(strikes["seq"], releases["seq"])], releases


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenes_contact_is_what_was_announced(name: str) -> None:
    announced, real = _announced_and_real(parse(shipped_text(name), name), 40)
    assert len(real) >= 5
    np.testing.assert_allclose(announced, real, rtol=1e-9)


@shows("pulse at the entry", "ours")
@pytest.mark.parametrize("name", CHANGED)
def test_what_effects_make_of_a_contact_is_announced_too(name: str) -> None:
    announced, real = _announced_and_real(parse(STICK + CHANGED[name], name), 20)
    assert len(real) >= 5
    np.testing.assert_allclose(announced, real, rtol=1e-9)


def test_without_hand_and_effects_it_is_the_isolated_blow() -> None:
    scene = Scene("free", stick=Stick(0.01, 2000.0, 0.8, 0.0, 0.0, 0.0, "unilateral"))
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["v_in"] = motion["v"] = -0.7
    motion["contact_phase"] = exact.CONTACT
    found = contact_ahead(law[0], motion[0], motion.copy())
    alone = isolated(law[0], 0.7)
    assert found.peak_N == pytest.approx(alone.peak_N, rel=1e-9)
    assert found.impulse_N_s == pytest.approx(alone.impulse_N_s, rel=1e-9)
    # A head that only pushes lets go below z = 0; the stick is in it until there. By hand: z'' = 0 from there on.
    out_s = 0.8 / 2000.0
    assert found.contact_s == pytest.approx(alone.contact_s + out_s, rel=1e-9)
    back = contact.beta_unilateral(0.01, 2000.0, 0.8)
    assert found.impulse_N_s == pytest.approx(0.01 * 0.7 * (1.0 + back), rel=1e-9)


def test_a_stick_that_stays_in_the_head_is_announced_as_its_blow_without_the_press() -> None:
    scene = parse(STICK.replace("k_hand_N_per_m = 4.0", "k_hand_N_per_m = 400.0"), "pressed")
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["v_in"] = motion["v"] = -0.05
    motion["contact_phase"] = exact.CONTACT
    found = contact_ahead(law[0], motion[0], motion.copy())
    np.testing.assert_allclose(found, isolated(law[0], 0.05), rtol=1e-12)
    assert found.contact_s < 0.01


@pytest.mark.parametrize(("k_hand", "is_pressed"), [(4.0, False), (400.0, True)])
def test_a_head_that_is_sampled_often_is_looked_at_for_so_many_samples(
    k_hand: float, is_pressed: bool
) -> None:
    """As long as a blow lasts, and no longer: each sample costs the tick that sees the strike."""
    effect = "[effects.system_delay]\nperiod_s = 0.0001\ndelay_ticks = 1\n"
    scene = parse(STICK.replace("k_hand_N_per_m = 4.0", f"k_hand_N_per_m = {k_hand}") + effect, "sampled")
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["v_in"] = motion["v"] = -0.3
    motion["contact_phase"] = exact.CONTACT
    found = contact_ahead(law[0], motion[0], motion.copy())
    assert (found == isolated(law[0], 0.3)) == is_pressed
    assert found.contact_s < 400 * 1e-4


def _arm(k: float, r: float, rate: int, gesture: str) -> Scene:
    text = sampled_arm.SCENE.format(gesture=gesture, device="", guard="") + f"[servo]\nrate_Hz = {rate}\n"
    return parse(
        text.replace("3500.0", f"{k}").replace("r_in_N_s_per_m = 2.5", f"r_in_N_s_per_m = {r}"), "arm"
    )


@pytest.mark.parametrize("gesture", ["single-stroke-roll", "double-stroke-roll"])
def test_a_hand_that_plays_a_roll_is_not_where_the_scene_rests_it(gesture: str) -> None:
    """Foreseen with the scene's hand at rest, single strokes were 1.7 dB of impulse off on the median, 5.4 at worst."""
    strikes, releases = _arms_contacts(_arm(3500.0, 2.5, 1000, gesture), 10.0)
    off_dB = 20.0 * np.log10(strikes["impulse_N_s"] / releases["impulse_N_s"])
    assert len(off_dB) >= 40
    assert abs(np.median(off_dB)) < 0.5
    assert np.abs(off_dB).max() < 1.5


@pytest.mark.parametrize(("k", "r"), [(3500.0, 2.5), (1500.0, 2.5), (800.0, 2.0), (400.0, 1.5)])
@pytest.mark.parametrize("rate", [1000, 4000])
def test_an_arms_contact_is_announced_from_what_encoders_tell(k: float, r: float, rate: int) -> None:
    """The hand is foreseen from how the arm moved before, though its owner may turn it meanwhile: of strokes, in dB."""
    scene = _arm(k, r, rate, "strokes")
    strikes, releases = _arms_contacts(scene, 10.0)
    assert len(strikes) >= 15
    for field, most_dB in (("peak_N", 1.0), ("impulse_N_s", 0.5)):
        off = 20.0 * np.log10(strikes[field] / releases[field])
        assert np.abs(off).max() < most_dB, field
    assert np.all(strikes["peak_N"] <= 8.5)
    assert math.isfinite(strikes["contact_s"].sum())
