"""`[mallet]`: what strikes the head where `[drum] excitation = "mallet"`. Its kernels: drumstick.drum.mallets."""

from dataclasses import dataclass
from typing import Any, Literal

from drumstick.parameters.declare import Scale, choice, number

# p is 3/2 wherever two bodies meet as spheres do (Hertz, "Ueber die Beruehrung fester elastischer Koerper", J. reine
# angew. Math. 92, 1881), and then K = 4/3 E* sqrt(R) with 1/E* = (1 - nu^2)/E of tip and head, and R the radius of
# curvature. The head is polyester, E = 5 GPa. wood: hickory across the grain, E = 1 GPa, R = 6 mm. nylon: E = 2.7 GPa,
# R = 6 mm. cork: E = 20 MPa, R = 12 mm. felt: p of a piano hammer's (Chaigne and Askenfelt, "Numerical simulations of
# piano strings. I", J. Acoust. Soc. Am. 95, 1994: 2.5, K = 4.5e9), K a twentieth of it, as a mallet's felt lies looser:
# by ear. hand: flat fingers, all an estimate. Estimates too, for all: losses, for rebounds of about 0.8 (wood, nylon),
# 0.6, 0.5 and 0.3 at 1 m/s off a wall; the patches that touch; masses, what the head feels of a stick that turns about
# the hand. That of wood was chosen for contacts of 3 to 6 ms, as measured on toms (Wagner, "Analysis of drumbeats", KTH
# 2006).
MATERIALS: dict[str, dict[str, float]] = {
    "wood": {
        "mass_kg": 0.005,
        "stiffness_N_per_m_p": 9e7,
        "exponent": 1.5,
        "loss_s_per_m": 0.3,
        "tip_radius_m": 0.004,
    },
    "nylon": {
        "mass_kg": 0.005,
        "stiffness_N_per_m_p": 1.9e8,
        "exponent": 1.5,
        "loss_s_per_m": 0.2,
        "tip_radius_m": 0.003,
    },
    "cork": {
        "mass_kg": 0.02,
        "stiffness_N_per_m_p": 2.9e6,
        "exponent": 1.5,
        "loss_s_per_m": 0.6,
        "tip_radius_m": 0.008,
    },
    "felt": {
        "mass_kg": 0.03,
        "stiffness_N_per_m_p": 2e8,
        "exponent": 2.5,
        "loss_s_per_m": 0.8,
        "tip_radius_m": 0.012,
    },
    "hand": {
        "mass_kg": 0.08,
        "stiffness_N_per_m_p": 2e6,
        "exponent": 2.0,
        "loss_s_per_m": 1.5,
        "tip_radius_m": 0.02,
    },
}


def _of_wood(
    name: str, low: float, high: float, unit: str, words: str, wire: str, scale: Scale = "linear"
) -> Any:
    words = f"{words}; where it is not given, the material's"
    return number(MATERIALS["wood"][name], low, high, unit, words, wire=wire, scale=scale, rebuilds=True)


@dataclass(frozen=True)
class Mallet:
    """A mallet whose tip pushes with F = K d^p (1 + lambda d') while it is pressed in by d, and never pulls."""

    material: Literal["wood", "nylon", "cork", "felt", "hand"] = choice(
        "wood", tuple(MATERIALS), "What the tip is made of: sets the defaults of the keys below"
    )
    mass_kg: float = _of_wood("mass_kg", 0.001, 1.0, "kg", "Effective mass at the tip", "mallet.mass", "log")
    stiffness_N_per_m_p: float = _of_wood(
        "stiffness_N_per_m_p",
        1e2,
        1e12,
        "N/m^p",
        "K of the contact force F = K d^p (1 + lambda d'), d: compression of the tip, d': its speed; comparable at "
        "equal p only",
        "mallet.stiffness",
        "log",
    )
    exponent: float = _of_wood("exponent", 1.0, 4.0, "1", "p, exponent of that force", "mallet.exponent")
    loss_s_per_m: float = _of_wood("loss_s_per_m", 0.0, 10.0, "s/m", "lambda, loss in the tip", "mallet.loss")
    tip_radius_m: float = _of_wood(
        "tip_radius_m",
        0.0005,
        0.1,
        "m",
        "Radius of the patch that the tip covers",
        "mallet.tip_radius",
        "log",
    )
