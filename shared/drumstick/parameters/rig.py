"""The rest of a scene: who plays, through which device, how fast, within which limits."""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, count, number, text


@dataclass(frozen=True)
class Device:
    """`[device]`: what the simulated device stands for, and how the head lies in a device's workspace."""

    plant: Literal["stick", "phantom"] = choice(
        "stick",
        ("stick", "phantom"),
        "The paper's stick itself, advanced exactly (stick); an arm that is sampled, as hardware is (phantom)",
    )
    delay_ticks: int = count(0, 0, 8, "ticks", "How late the simulated arm gets its force")
    friction_N: float = number(0.04, 0.0, 2.0, "N", "Friction of the arm, simulated or real")
    head_z_m: float = number(0.0, -0.3, 0.3, "m", "Height of the head in the device's workspace")
    reach_m: float = number(0.08, 0.01, 0.5, "m", "Distance in the workspace that is the radius of the head")


@dataclass(frozen=True)
class Servo:
    """`[servo]`: the force loop."""

    rate_Hz: int = count(1000, 500, 4000, "Hz", "Ticks a second")
    cpu: int = count(-1, -1, 1023, "number", "Processor that the loop stays on; -1 leaves it to the system")
    spin_us: int = count(
        0, 0, 200, "us", "Awake for the last so many us of each tick: less lateness, more power"
    )
    predictor: Literal["lead", "off"] = choice(
        "lead",
        ("lead", "off"),
        "On sampled devices: whether the position is led by T/2 and the device's delay",
    )


@dataclass(frozen=True)
class Hand:
    """`[hand]`: the simulated player. It throws the stick, holds it, and moves over the head on a circle."""

    gesture: Literal["hold", "strokes", "single-stroke-roll", "double-stroke-roll", "press", "recorded"] = (
        choice(
            "hold",
            ("hold", "strokes", "single-stroke-roll", "double-stroke-roll", "press", "recorded"),
            "What the hand does with a sampled arm; it throws and holds the exact stick",
        )
    )
    gesture_file: str = text(
        "", "Where a recorded gesture is written: CSV with t_s and z_m, beside the scene; it repeats"
    )
    gesture_height_m: float = number(
        0.04, 0.0, 0.2, "m", "How far a gesture lifts the hand above where it holds"
    )
    gesture_period_s: float = number(0.5, 0.05, 10.0, "s", "Time between the strokes of a gesture")
    throw_m_per_s: float = number(0.4, 0.01, 5.0, "m/s", "Upward speed of a throw, from z = 0")
    rest_s: float = number(
        0.5, 0.05, 60.0, "s", "How long a stick rests dead before the player throws it again"
    )
    orbit_radius: float = number(0.45, 0.0, 0.95, "of the radius", "The strikes walk on a circle this large")
    orbit_period_s: float = number(8.0, 0.1, 3600.0, "s", "Time for once around")


@dataclass(frozen=True)
class Guard:
    """`[guard]`: limits for live sets, only tighter than the device's own (defaults: the stick plant's)."""

    max_force_N: float = number(100.0, 0.1, 100.0, "N", "Largest predicted contact force plus pulse")
    max_speed_m_per_s: float = number(10.0, 0.1, 10.0, "m/s", "Largest predicted speed of the roll")
    max_slew_N_per_s: float = number(
        20000.0, 100.0, 1e6, "N/s", "Fastest change of force on a sampled device"
    )
    ramp_s: float = number(0.3, 0.05, 5.0, "s", "On a sampled device force comes back over this time")
    dead_man: Literal["off", "button"] = choice(
        "off", ("off", "button"), "button: a sampled device pushes only while its button is held"
    )
    lowest_m: float = number(-0.1, -0.3, -0.001, "m", "Lowest position, from the head, on a sampled device")
    highest_m: float = number(0.3, 0.01, 0.5, "m", "Highest position, from the head, on a sampled device")
