"""The stick in the hand and the head it meets: `[stick]`, equations (1) and (2).

above   m z'' + R_out z' + K_hand (z - z_ss) = f                 (1)
inside  m z'' + R_in  z' + K_hand (z - z_ss) + K_coll z = f      (2)

z_ss = z_h0 - m g*/K_hand is where the stick would rest without a head; z_h0 is where the hand holds its
spring. m and g* are those of the tip of a stick that turns about the grip: given directly, or by `Geometry`.
"""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, number, required

GRAVITY_M_PER_S2 = 9.80665  # g* of a stick whose scene gives m directly; standard gravity, CGPM 1901


@dataclass(frozen=True)
class Stick:
    """Stick and contact; the defaults are the parameter set A (a light stick, a tight head)."""

    m_kg: float = number(
        0.015, 1e-4, 1.0, "kg", "Mass of the stick as the head feels it",
        symbol="m", equation="(1), (2)", wire="m", scale="log",
    )  # fmt: skip
    k_coll_N_per_m: float = number(
        5000.0, 1.0, 1e6, "N/m", "Stiffness of the head: higher is a harder, shorter contact",
        symbol="K_coll", equation="(2), (3)", wire="k_coll", scale="log",
    )  # fmt: skip
    r_in_N_s_per_m: float = number(
        1.3, 0.0, 1e3, "N s/m", "Damping in contact: higher gives less rebound",
        symbol="R_in", equation="(2), (3)", wire="r_in",
    )  # fmt: skip
    k_hand_N_per_m: float = number(
        20.0, 0.0, 1e4, "N/m", "Stiffness of the hand's hold: higher makes a faster roll",
        symbol="K_hand", equation="(1), (2)", wire="k_hand",
    )  # fmt: skip
    r_out_N_s_per_m: float = number(
        0.1, 0.0, 1e3, "N s/m", "Damping of the hand above the head",
        symbol="R_out", equation="(1)", wire="r_out",
    )  # fmt: skip
    z_ss_m: float = number(
        -0.02, -1.0, 1.0, "m", "Where the stick would rest without a head: below 0 it presses on the head",
        symbol="z_ss", equation="(1), (2)", wire="z_ss",
    )  # fmt: skip
    release: Literal["paper", "unilateral"] = choice(
        "unilateral", ("paper", "unilateral"),
        "When contact ends: at z = 0, the damper may pull the stick back (paper); "
        "when the head stops pushing (unilateral)",
    )  # fmt: skip
    g_star_m_per_s2: float = number(
        GRAVITY_M_PER_S2, -100.0, 100.0, "m/s^2", "Gravity as the head feels it at the tip",
        symbol="g*", equation="z_ss = z_h0 - m g*/K_hand",
    )  # fmt: skip


@dataclass(frozen=True)
class Geometry:
    """`[stick.geometry]`: a rigid stick that turns about the hand. Positions along it, from any one end.

    With L = tip - grip and I = inertia + mass (com - grip)^2, the inertia about the grip, a force F at the tip gives
    it the acceleration F L^2/I, so m = I/L^2; its weight acts with mass g (com - grip)/L there, which is m g*.
    """

    inertia_kg_m2: float = required(1e-8, 1.0, "kg m^2", "Rotational inertia about the centre of mass")
    mass_kg: float = required(1e-4, 10.0, "kg", "Mass of the whole stick")
    grip_m: float = required(-2.0, 2.0, "m", "Where the hand holds it: the axis it turns about")
    tip_m: float = required(-2.0, 2.0, "m", "Where it meets the head")
    com_m: float = required(-2.0, 2.0, "m", "Its centre of mass")

    @property
    def arm_m(self) -> float:
        """L, from grip to tip."""
        return self.tip_m - self.grip_m

    @property
    def m_kg(self) -> float:
        """Mass as the head feels it at the tip."""
        return (self.inertia_kg_m2 + self.mass_kg * (self.com_m - self.grip_m) ** 2) / self.arm_m**2

    @property
    def g_star_m_per_s2(self) -> float:
        """Gravity as the head feels it at the tip; below 0 when the stick is held beyond its centre of mass."""
        leverage = (self.com_m - self.grip_m) / self.arm_m
        return GRAVITY_M_PER_S2 * self.mass_kg * leverage / self.m_kg
