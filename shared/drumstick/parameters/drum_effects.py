"""What a drum can have besides its head: `[drum.effects.NAME]`. Absent unless named; the sound server computes them."""

from dataclasses import dataclass

from drumstick.parameters.declare import count, number, numbers


@dataclass(frozen=True)
class AirLoss:
    """The air takes from all modes alike, besides the drum's own decay. Costs nothing: it is in the coefficients."""

    t60_s: float = number(3.0, 0.02, 60.0, "s", "Time in which the air alone would take 60 dB")


@dataclass(frozen=True)
class InternalLoss:
    """The head's material takes more from quick modes: a dull head rather than a bright one."""

    t60_s: float = number(0.15, 0.001, 60.0, "s", "Time in which a mode at at_Hz falls by 60 dB")
    at_Hz: float = number(2000.0, 50.0, 20000.0, "Hz", "Where that is so; below, the loss falls with f^2")


@dataclass(frozen=True)
class Muffle:
    """Gel, felt or a hand on the head."""

    patches: tuple[tuple[float, ...], ...] = numbers(
        ((0.75, 0.0, 0.15),), 3, -1.0, 1.0, "of the radius", "Patches, each [x, y, radius]"
    )
    t60_s: float = number(
        0.05, 0.001, 60.0, "s", "Time in which the junctions under a patch would lose 60 dB"
    )


@dataclass(frozen=True)
class Tension:
    """A hard stroke stretches the head: the pitch glides down as it calms."""

    glide_cents: float = number(
        60.0, 0.0, 1200.0, "cents", "How far a stroke of full scale at half radius raises the pitch"
    )


@dataclass(frozen=True)
class Cavity:
    """A second head on the other side, coupled by the air between."""

    depth_m: float = number(0.3, 0.02, 2.0, "m", "Between the heads")
    head_kg_per_m2: float = number(0.26, 0.05, 2.0, "kg/m^2", "Both heads' mass per area")
    f01_Hz: float = number(180.0, 20.0, 2000.0, "Hz", "Pitch of the second head alone")
    t60_s: float = number(1.0, 0.02, 60.0, "s", "Its own decay")
    heard: float = number(0.5, 0.0, 1.0, "1", "How much of the second head the pickups hear")


@dataclass(frozen=True)
class Snare:
    """Wires across the second head, which rattle on it. Needs `cavity`, whose head they lie on."""

    wires: int = count(12, 1, 40, "wires", "Side by side across the head")
    f_Hz: float = number(300.0, 20.0, 2000.0, "Hz", "Pitch of a wire by itself")
    t60_s: float = number(0.08, 0.005, 10.0, "s", "Its own decay")
    mass: float = number(0.08, 0.001, 1.0, "of the head", "Of all wires together")
    press: float = number(
        0.1,
        0.0,
        2.0,
        "1",
        "How firmly they lie on: to what a stroke of full scale at half radius does to the head",
    )


@dataclass(frozen=True)
class Rim:
    """The hoop answers to strokes on the rim, and a little to those near it."""

    f_Hz: float = number(700.0, 50.0, 8000.0, "Hz", "Pitch of its lowest mode")
    t60_s: float = number(0.12, 0.005, 10.0, "s", "Decay of its lowest mode")
    level: float = number(0.6, 0.0, 4.0, "1", "Of a full stroke on the rim, to one on the head")
    width: float = number(0.1, 0.01, 0.5, "radii", "How far inside the rim it is felt")


# The order here is the order of the panel and of the documentation; the kernels' own is in drumstick.drum.step.
DRUM_EFFECTS: dict[str, type] = {
    "air_loss": AirLoss,
    "internal_loss": InternalLoss,
    "muffle": Muffle,
    "tension": Tension,
    "cavity": Cavity,
    "snare": Snare,
    "rim": Rim,
}
