"""The rest of a scene: who plays, through which device, how fast, within which limits."""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, count, number, required, text

MAX_DELAY_TICKS = 8  # of a sampled device: servo, guard and the simulated arm keep so many forces


@dataclass(frozen=True)
class Device:
    """`[device]`: what the simulated device stands for, and how the head lies in a device's workspace."""

    plant: Literal["stick", "phantom"] = choice(
        "stick",
        ("stick", "phantom"),
        "stick: the paper's stick, simulated without an arm and without time-step error; phantom: a simulated arm,"
        " read once a tick as hardware is",
    )
    delay_ticks: int = count(0, 0, MAX_DELAY_TICKS, "ticks", "How late the simulated arm gets its force")
    friction_N: float = number(0.04, 0.0, 2.0, "N", "Friction of the arm, simulated or real")
    head_z_m: float = number(0.0, -0.3, 0.3, "m", "Height of the head in the device's workspace")
    reach_m: float = number(
        0.08,
        0.01,
        0.5,
        "m",
        "How far the device's tip moves sideways from the centre to the edge of the head",
    )


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
        "On sampled devices: lead corrects the position for half a tick and the device's delay; off does not",
    )


@dataclass(frozen=True)
class Human:
    """`[hand.human]`: how uneven the simulated player's roll is. Both spreads must be given: no published one is known
    to us that could be a default.
    """

    interval_percent: float = required(
        0.0, 10.0, "%", "Standard deviation of the time from strike to strike, of its mean"
    )
    level_dB: float = required(0.0, 2.0, "dB", "Standard deviation of the strikes' speed")
    seed: int = count(
        1, 0, 2**31 - 1, "1", "Start of the random numbers: the same seed plays the same performance"
    )


@dataclass(frozen=True)
class Hand:
    """`[hand]`: the simulated player. It throws the stick, holds it, and moves over the head on a circle."""

    gesture: Literal["hold", "strokes", "single-stroke-roll", "double-stroke-roll", "press", "recorded"] = (
        choice(
            "hold",
            ("hold", "strokes", "single-stroke-roll", "double-stroke-roll", "press", "recorded"),
            "How the simulated hand moves a simulated arm ([device] plant phantom); with plant stick the hand only "
            "throws the stick, except that recorded moves it there too",
        )
    )
    gesture_file: str = text(
        "",
        "File that holds the recorded gesture, read at the start: CSV with t_s, and z_m or columns of the grip, beside "
        "the scene; it repeats",
    )
    hands: Literal[1, 2] = choice(
        1,
        (1, 2),
        "2: two hands with a stick each, half a gesture apart, played offline (simulate, analyse, render) and not live",
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
    human: Human | None = None

    @property
    def why_not_live(self) -> str:
        """Words: why the servo cannot play these hands; empty where it can."""
        if self.hands == 1:
            return ""
        return (
            "has two hands with a stick each, and the servo plays one stick: "
            "`drumstick simulate`, `analyse` and `render` play both"
        )


@dataclass(frozen=True)
class Guard:
    """`[guard]`: limits for live sets, only tighter than the device's own (defaults: the stick plant's)."""

    max_force_N: float = number(
        100.0, 0.1, 100.0, "N",
        "A set is refused whose predicted contact force plus pulse is larger; a sampled device's force is cut to it",
    )  # fmt: skip
    max_speed_m_per_s: float = number(
        10.0, 0.1, 10.0, "m/s",
        "A set is refused whose predicted speed is larger; on a sampled device a faster stick is a latched fault",
    )  # fmt: skip
    max_slew_N_per_s: float = number(
        20000.0, 100.0, 1e6, "N/s", "Fastest change of force on a sampled device"
    )
    ramp_s: float = number(0.3, 0.05, 5.0, "s", "On a sampled device force comes back over this time")
    dead_man: Literal["off", "button"] = choice(
        "off", ("off", "button"), "button: a sampled device pushes only while its button is held"
    )
    lowest_m: float = number(
        -0.1,
        -0.3,
        -0.001,
        "m",
        "On a sampled device force fades over the 10 mm above this height, from the head",
    )
    highest_m: float = number(
        0.3, 0.01, 0.5, "m", "On a sampled device there is no force above this height, from the head"
    )
