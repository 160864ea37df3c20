"""The rest of a scene: who plays, through which device, how fast, within which limits."""

from dataclasses import dataclass
from typing import Literal

from drumstick.declare import choice, count, number


@dataclass(frozen=True)
class Device:
    """`[device]`: what the simulated device stands for."""

    plant: Literal["stick"] = choice("stick", ("stick",), "The paper's stick itself, advanced exactly")


@dataclass(frozen=True)
class Servo:
    """`[servo]`: the force loop."""

    rate_Hz: int = count(1000, 500, 4000, "Hz", "Ticks a second")  # noqa: N815


@dataclass(frozen=True)
class Hand:
    """`[hand]`: the simulated player. It throws the stick, holds it, and moves over the head on a circle."""

    throw_m_per_s: float = number(0.4, 0.01, 5.0, "m/s", "Upward speed of a throw, from z = 0")
    rest_s: float = number(
        0.5, 0.05, 60.0, "s", "How long a stick rests dead before the player throws it again"
    )
    orbit_radius: float = number(0.45, 0.0, 0.95, "of the radius", "The strikes walk on a circle this large")
    orbit_period_s: float = number(8.0, 0.1, 3600.0, "s", "Time for once around")


@dataclass(frozen=True)
class Strike:
    """`[strike]`: how strikes become numbers for instruments."""

    full_scale_m_per_s: float = number(2.0, 0.01, 20.0, "m/s", "Speed of a strike whose level is 1")


@dataclass(frozen=True)
class Guard:
    """`[guard]`: limits for live sets, only tighter than the device's own (defaults: the stick plant's)."""

    max_force_N: float = number(100.0, 0.1, 100.0, "N", "Largest predicted contact force plus pulse")  # noqa: N815
    max_speed_m_per_s: float = number(10.0, 0.1, 10.0, "m/s", "Largest predicted speed of the roll")
