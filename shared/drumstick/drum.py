"""The drum that is heard: `[drum]`, `[mesh]`, `[listen]`. Its kernels live in the sound server."""

from dataclasses import dataclass
from typing import Literal

from drumstick.declare import choice, number, numbers


@dataclass(frozen=True)
class Drum:
    """A circular membrane, clamped at the rim."""

    radius_m: float = number(0.16, 0.02, 1.0, "m", "Radius of the head")
    f01_Hz: float = number(150.0, 20.0, 2000.0, "Hz", "Pitch of the lowest mode")  # noqa: N815
    t60_s: float = number(1.2, 0.02, 60.0, "s", "Time in which the sound falls by 60 dB")
    inject: Literal["nearest"] = choice("nearest", ("nearest",), "Which junctions take the force")
    excitation: Literal["analytic"] = choice(
        "analytic", ("analytic",), "Contact force as implied by one strike message: a damped half-sine"
    )
    latency_s: float = number(
        0.0, 0.0, 0.5, "s", "A strike sounds this long after its contact; 0 plays it at once"
    )


@dataclass(frozen=True)
class Mesh:
    """How finely the membrane is computed: the mesh rate is the device rate over a whole number."""

    accuracy: Literal["draft", "standard", "fine"] = choice(
        "standard", ("draft", "standard", "fine"), "draft: rate/4, standard: rate/3, fine: rate/2"
    )


@dataclass(frozen=True)
class Listen:
    """Where the drum is heard."""

    gain_dB: float = number(0.0, -60.0, 12.0, "dB", "Level of the drum")  # noqa: N815
    pickups: tuple[tuple[float, ...], ...] = numbers(
        ((-0.45, 0.3, -0.6), (0.5, 0.25, 0.6)), 3, -1.0, 1.0, "of the radius; pan -1 left .. 1 right",
        "Pickups, each [x, y, pan]",
    )  # fmt: skip
