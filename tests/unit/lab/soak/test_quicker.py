"""A quicker stick is the same stick: N times the rate, the same speeds, forces and restitution."""

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.simulate import simulate
from drumstick_lab.soak.quicker import quicker
from rig.exit_status import GIVEN, CommandError


@pytest.mark.parametrize("speed", [2.0, 20.0, 100.0])
def test_the_contacts_are_the_same_but_sooner(speed: float) -> None:
    usual = simulate(parse(shipped_text("roll"), "roll"), 1.0, 0.4).contacts
    made = simulate(parse(quicker(shipped_text("roll"), "roll", speed), "quick"), 1.0 / speed, 0.4).contacts
    assert len(usual) > 20
    assert len(made) == pytest.approx(len(usual), abs=1)
    t_in, v_in, t_out, v_out, v_e, peak_N, impulse, z_min = (
        pair for pair in zip(made[15], usual[15], strict=True)
    )
    for scaled, own in (t_in, t_out, impulse, z_min):
        assert scaled == pytest.approx(own / speed, rel=1e-9)
    for same, own in (v_in, v_out, v_e, peak_N):
        assert same == pytest.approx(own, rel=1e-9)


def test_defaults_that_the_text_leaves_out_are_scaled_too() -> None:
    text = 'name = "bare"\n[stick]\nm_kg = 0.02\n'
    made, own = parse(quicker(text, "bare", 4.0), "bare").stick, parse(text, "bare").stick
    assert made.k_hand_N_per_m == pytest.approx(4.0 * own.k_hand_N_per_m)
    assert made.z_ss_m == pytest.approx(own.z_ss_m / 4.0)
    assert made.r_in_N_s_per_m == own.r_in_N_s_per_m


def test_drum_and_sound_stay_what_they_are() -> None:
    for name in ("snare", "timpani", "tom"):
        made, own = parse(quicker(shipped_text(name), name, 5.0), name), parse(shipped_text(name), name)
        assert (made.drum, made.mesh, made.listen, made.words) == (own.drum, own.mesh, own.listen, own.words)


@pytest.mark.parametrize(
    ("scene", "says"),
    [("accents", "sampled arm"), ("grip", r"grip\.csv"), ("rejected-by-the-paper", "effects.noise.hold_s")],
)
def test_what_cannot_be_made_quicker_is_refused_in_words(scene: str, says: str) -> None:
    with pytest.raises(CommandError, match=says) as stop:
        quicker(shipped_text(scene), scene, 20.0)
    assert stop.value.status == GIVEN


def test_a_geometry_is_refused() -> None:
    geometry = "inertia_kg_m2 = 0.0012\nmass_kg = 0.05\ngrip_m = 0.1\ntip_m = 0.4\ncom_m = 0.2\n"
    text = f'name = "g"\n[stick.geometry]\n{geometry}'
    with pytest.raises(CommandError, match="m_kg"):
        quicker(text, "g", 2.0)
