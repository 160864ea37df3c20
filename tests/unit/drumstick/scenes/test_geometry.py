"""The stick's m and g* from its geometry, z_ss from where the hand holds it, and what is refused."""

import pytest

from drumstick.parameters.stick import GRAVITY_M_PER_S2
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse

GEOMETRY = """
[stick]
k_hand_N_per_m = 20.0
{stick}
[stick.geometry]
inertia_kg_m2 = 7.5e-4
mass_kg = 0.055
grip_m = 0.13
tip_m = 0.406
com_m = 0.19
"""


def test_m_and_g_star_are_those_of_a_lever() -> None:
    """A force at the tip and the weight at the centre of mass, both about the grip."""
    stick = parse(GEOMETRY.format(stick="z_ss_m = -0.02"), "lever").stick
    inertia = 7.5e-4 + 0.055 * 0.06**2
    arm = 0.406 - 0.13
    assert stick.m_kg == pytest.approx(inertia / arm**2, rel=1e-14)
    angular = 0.055 * GRAVITY_M_PER_S2 * 0.06 / inertia  # the stick's own fall, held at the grip
    assert stick.g_star_m_per_s2 == pytest.approx(angular * arm, rel=1e-14)
    assert stick.z_ss_m == -0.02


def test_a_point_mass_at_the_tip_is_itself() -> None:
    text = (
        GEOMETRY.format(stick="").replace("7.5e-4", "1e-8").replace("0.19", "0.406").replace("0.055", "0.02")
    )
    stick = parse(text, "point").stick
    assert stick.m_kg == pytest.approx(0.02, rel=1e-5)
    assert stick.g_star_m_per_s2 == pytest.approx(GRAVITY_M_PER_S2, rel=1e-5)


def test_held_beyond_its_centre_of_mass_it_rises() -> None:
    assert parse(GEOMETRY.format(stick="").replace("0.13", "0.25"), "beyond").stick.g_star_m_per_s2 < 0.0


def test_z_h0_is_another_view_of_z_ss() -> None:
    stick = parse(GEOMETRY.format(stick="z_h0_m = 0.01"), "held").stick
    assert stick.z_ss_m == pytest.approx(0.01 - stick.m_kg * stick.g_star_m_per_s2 / 20.0, rel=1e-14)
    direct = parse(
        "[stick]\nm_kg = 0.02\nz_h0_m = 0.01\nk_hand_N_per_m = 40.0\ng_star_m_per_s2 = 5.0\n", "d"
    ).stick
    assert direct.z_ss_m == pytest.approx(0.01 - 0.02 * 5.0 / 40.0, rel=1e-14)


def test_it_survives_the_wire() -> None:
    scene = parse(GEOMETRY.format(stick="z_h0_m = 0.01"), "held")
    assert from_tables(as_tables(scene)).stick == scene.stick


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (GEOMETRY.format(stick="m_kg = 0.01"), "lever:4: stick.m_kg: follows from [stick.geometry]"),
        (GEOMETRY.format(stick="").replace("mass_kg = 0.055\n", ""), "missing: mass_kg"),
        (GEOMETRY.format(stick="").replace("0.406", "0.131"), "at least 0.01 m apart"),
        (GEOMETRY.format(stick="").replace("7.5e-4", "0.5"), "m_kg = 6.56"),
        (GEOMETRY.format(stick="").replace("0.055", "nan"), "lever:7: stick.geometry.mass_kg: nan must be a finite"),
        (GEOMETRY.format(stick="").replace("mass_kg", "mass_g"), "lever:7: stick.geometry.mass_g: unknown key"),
        ("[stick]\nz_h0_m = 0.01\nz_ss_m = 0.0\n", "lever:2: stick.z_h0_m: z_h0_m and z_ss_m are two views"),
        ("[stick]\nz_h0_m = 0.01\nk_hand_N_per_m = 0.0\n", "no meaning while k_hand_N_per_m is 0"),
        ("[stick]\nz_h0_m = 0.9\nm_kg = 1.0\nk_hand_N_per_m = 0.1\n", "z_ss_m = -97.1"),
        ("[stick]\ngeometry = 3\n", "must be a table"),
    ],
)  # fmt: skip
def test_mistakes_are_named(text: str, said: str) -> None:
    with pytest.raises(SceneError) as refused:
        parse(text, "lever")
    assert said in str(refused.value)
