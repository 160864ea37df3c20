"""The drum that is heard: `[drum]`, `[mesh]` or `[modal]`, `[listen]`. Its kernels: drumstick.drum."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from drumstick.parameters.declare import choice, count, number, numbers

HEAD_KG_PER_M2 = 0.26  # of a head that nothing else is told of: 0.19 mm of polyester


@dataclass(frozen=True)
class Drum:
    """A circular membrane, clamped at the rim. `effects`: of each that the scene names its table."""

    radius_m: float = number(0.16, 0.02, 1.0, "m", "Radius of the head")
    f01_Hz: float = number(
        150.0, 20.0, 2000.0, "Hz", "Pitch of the lowest mode", wire="drum.f01", scale="log", rebuilds=True
    )
    t60_s: float = number(
        1.2,
        0.02,
        60.0,
        "s",
        "Time in which the sound falls by 60 dB",
        wire="drum.t60",
        scale="log",
        rebuilds=True,
    )
    inject: Literal["nearest", "linear"] = choice(
        "nearest",
        ("nearest", "linear"),
        "Which junctions take the force: the nearest one, or those around by their nearness",
    )
    excitation: Literal["analytic", "streamed", "mallet"] = choice(
        "analytic",
        ("analytic", "streamed", "mallet"),
        "analytic: the damped contact that one strike message announces; streamed: the force itself, tick by tick; "
        "mallet: a mallet of the strike's speed meets the moving head, see [mallet]",
    )
    latency_s: float = number(
        0.0, 0.0, 0.5, "s", "A strike sounds this long after its contact; 0 plays it as soon as it can be"
    )
    effects: Mapping[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True)
class Mesh:
    """Fineness of the membrane: the mesh rate is the device rate over a whole number."""

    accuracy: Literal["draft", "standard", "fine", "auto"] = choice(
        "standard",
        ("draft", "standard", "fine", "auto"),
        "draft, standard, fine: a mesh step for every 4th, 3rd, 2nd audio sample, or more often for a high head; fine "
        "uses a more accurate formula (fourth order), and so does standard where the usual one is not enough. In both, "
        "each of the first twenty modes is within 4 cents (of a head above 1200 Hz, at 48 kHz, those up to 4 kHz). "
        "auto: the cheapest on the machine that plays whose error is at most auto_jnd, and which is no duller than "
        "standard; where no such mesh fits cpu_budget, the brightest that is in tune, or else the most accurate",
    )
    topology: Literal["triangular", "rectilinear"] = choice(
        "triangular", ("triangular", "rectilinear"), "Six neighbours or four; rectilinear is for comparison"
    )
    courant: Literal["limit", "lossless"] = choice(
        "limit",
        ("limit", "lossless"),
        "limit: the largest stable step; lossless: the textbook mesh, whose waves cover less of the mesh in a step, "
        "for comparison",
    )
    rate_Hz: float = number(
        0.0,
        0.0,
        192000.0,
        "Hz",
        "Mesh steps per second, rounded to the audio rate over a whole number; 0: as accuracy says",
    )
    junctions_across: float = number(
        0.0, 0.0, 1000.0, "junctions", "At least so many across the head, by the mesh rate; 0: by accuracy"
    )
    cpu_budget: float = number(
        0.4,
        0.01,
        0.95,
        "of a core",
        "What one head may take; a mesh that would take more is computed at a lower rate",
    )
    threads: int = count(
        1,
        1,
        2,
        "threads",
        "2: a second real-time thread computes up to half of a large mesh, on a core that is free. Not with accuracy "
        "fine; with tension or a second head it helps less. cpu_budget is reckoned as for one thread",
    )
    auto_jnd: float = number(
        0.5,
        0.05,
        10.0,
        "JND",
        'How far off accuracy = "auto" may be: rms error of the first twenty modes, in just noticeable differences of '
        "pitch (JND), where the ear is sharpest among them. The worst mode is off by about twice as much: at 0.5 "
        "nobody hears it",
    )


@dataclass(frozen=True)
class Modal:
    """Instead of a mesh: the head's modes themselves, each exact while the tension rests."""

    top_Hz: float = number(
        10000.0,
        200.0,
        20000.0,
        "Hz",
        "Modes up to here are computed; with tension at most 0.22 of the sample rate (10.5 kHz at 48 kHz), less if its "
        "most_cents is high",
    )


@dataclass(frozen=True)
class Listen:
    """Pickups or microphones of the drum."""

    gain_dB: float = number(0.0, -60.0, 12.0, "dB", "Level of the drum", wire="listen.gain")
    pan: float = number(
        0.0,
        -1.0,
        1.0,
        "1",
        "Balance of the drum: above 0 the left grows quieter, at 1 it is silent; below 0 the right",
        wire="listen.pan",
    )
    mute: float = number(
        0.0, 0.0, 1.0, "1", "How much of the level is taken away: 1 is silence", wire="listen.mute"
    )
    pickups: tuple[tuple[float, ...], ...] = numbers(
        ((-0.45, 0.3, -0.6), (0.5, 0.25, 0.6)), 3, -1.0, 1.0, "of the radius; pan -1 left .. 1 right",
        "Contact pickups on the head, each [x, y, pan]",
    )  # fmt: skip
    pickup_places: Literal["fixed", "live"] = choice(
        "fixed",
        ("fixed", "live"),
        "live: x and y of each pickup can be set while it plays, as pickup-1.x, pickup-1.y, pickup-2.x and so on, "
        "within the rim; a crossfade of 30 ms leads from place to place. A bank of modes has 20,000 at most then. "
        "Microphones stay where they are",
    )
    microphones: tuple[tuple[float, ...], ...] = numbers(
        (), 4, -50.0, 50.0, "of the radius; pan -1 left .. 1 right",
        "Microphones in the air, each [x, y, height, pan]; where there are any, no pickup is heard",
    )  # fmt: skip
