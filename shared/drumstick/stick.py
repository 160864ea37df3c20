"""The stick in the hand and the head it meets: `[stick]`, equations (1) and (2).

above   m z'' + R_out z' + K_hand (z - z_ss) = f                 (1)
inside  m z'' + R_in  z' + K_hand (z - z_ss) + K_coll z = f      (2)

z_ss = z_h0 - m g*/K_hand is where the stick would rest without a head; z_h0 is where the hand holds its
spring.
"""

from dataclasses import dataclass
from typing import Literal

from drumstick.declare import choice, number

GRAVITY_M_PER_S2 = 9.80665  # g* of a stick whose scene gives m directly; standard gravity, CGPM 1901


@dataclass(frozen=True)
class Stick:
    """Stick and contact; the defaults are the parameter set A (a light stick, a tight head)."""

    m_kg: float = number(
        0.015, 1e-4, 1.0, "kg", "Mass of the stick as the head feels it",
        symbol="m", equation="(1), (2)", wire="m", scale="log",
    )  # fmt: skip
    k_coll_N_per_m: float = number(  # noqa: N815  the unit newton is written N
        5000.0, 1.0, 1e6, "N/m", "Stiffness of the head: higher is a harder, shorter contact",
        symbol="K_coll", equation="(2), (3)", wire="k_coll", scale="log",
    )  # fmt: skip
    r_in_N_s_per_m: float = number(  # noqa: N815
        1.3, 0.0, 1e3, "N s/m", "Damping in contact: higher gives less rebound",
        symbol="R_in", equation="(2), (3)", wire="r_in",
    )  # fmt: skip
    k_hand_N_per_m: float = number(  # noqa: N815
        20.0, 0.0, 1e4, "N/m", "Stiffness of the hand's hold: higher makes a faster roll",
        symbol="K_hand", equation="(1), (2)", wire="k_hand",
    )  # fmt: skip
    r_out_N_s_per_m: float = number(  # noqa: N815
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
