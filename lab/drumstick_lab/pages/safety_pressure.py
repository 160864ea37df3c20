"""Pressure at the tip of an arm, for docs/safety.md: limits by place of the body, second-hand, and least radii."""

import math
from typing import NamedTuple

from drumstick_lab.pages.safety_limits import SCENE, table

FIRST_FORCE_N = 1.0  # docs/phantom.md, "First force"
OTHER_FORCES_N = {"Touch": 3.3, "Touch X": 7.9}  # second-hand
BARE_TIP_MM2 = 1.0
PEAK_OVER_MEAN = 1.5  # a ball that is pressed into a soft body (Hertz): largest pressure over the mean one
BALL_M, FACE_BALL_M = 5e-3, 10e-3


class Place(NamedTuple):
    """A row of Table A.2 in ISO/TS 15066:2016, second-hand: N/cm^2, N, and in how many copies we found it."""

    words: str
    pressure: float
    force_N: float
    seen: int


HAND_N, FACE_N, SKULL_N, TRANSIENT = 140.0, 65.0, 130.0, 2.0
HAND = (
    Place("forefinger pad, dominant hand", 300.0, HAND_N, 2),
    Place("forefinger pad, other hand", 270.0, HAND_N, 1),
    Place("forefinger end joint, dominant hand", 280.0, HAND_N, 2),
    Place("forefinger end joint, other hand", 220.0, HAND_N, 1),
    Place("thenar eminence (ball of the thumb)", 200.0, HAND_N, 2),
    Place("palm", 260.0, HAND_N, 2),
    Place("back of the hand, dominant hand", 200.0, HAND_N, 2),
    Place("back of the hand, other hand", 190.0, HAND_N, 1),
)
FACE = (
    Place("masticatory muscle (cheek)", 110.0, FACE_N, 2),
    Place("middle of the forehead", 130.0, SKULL_N, 2),
    Place("temple", 110.0, SKULL_N, 2),
)
# The older German proposal, second-hand too: N/cm^2.
OLDER_HAND, OLDER_FACE = 60.0, 20.0
# Table A.3, second-hand: stiffness of the place, N/m, and the mass behind it, kg.
HAND_BODY, FACE_BODY = (75e3, 0.6), (75e3, 4.4)


def least_radius_m(force_N: float, pressure_N_per_cm2: float, peak: float = 1.0) -> float:
    """Radius of the round area over which this force stays within that pressure; `peak`: largest over mean."""
    return math.sqrt(peak * force_N / (math.pi * pressure_N_per_cm2 * 1e4))


def depth_m(ball_m: float, radius_m: float) -> float:
    """Indentation at which a ball's area of contact has that radius: a^2 / R (Hertz), as its pressure is reckoned too."""
    return radius_m**2 / ball_m


def impact_force(speed_m_per_s: float, arm_kg: float, body: tuple[float, float]) -> float:
    """Largest force of a free arm on a part of the body: both masses on the spring of the tissue."""
    stiffness, mass = body
    return speed_m_per_s * math.sqrt(stiffness / (1.0 / arm_kg + 1.0 / mass))


def body_limits() -> str:
    """Table A.2, as far as it matters here."""
    copies = {1: "one copy", 2: "two copies"}
    allowed = dict.fromkeys(FACE, "none") | {
        place: f"{place.pressure * TRANSIENT:g} N/cm², {place.force_N * TRANSIENT:g} N" for place in HAND
    }
    head = ("place", "pressure, N/cm²", "force, N", "in short contact", "found in")
    return table(
        [
            head,
            *(
                (place.words, f"{place.pressure:g}", f"{place.force_N:g}", allowed[place], copies[place.seen])
                for place in (*HAND, *FACE)
            ),
        ]
    )


def radii() -> str:
    """Least radii of the area of contact, for forces and limits."""
    hand, face = min(p.pressure for p in HAND), min(p.pressure for p in FACE)
    forces = {
        f"{FIRST_FORCE_N:g} N: first session": FIRST_FORCE_N,
        **{f"{force:g} N: {name} (second-hand)": force for name, force in OTHER_FORCES_N.items()},
        f"{SCENE.guard.max_force_N:g} N: scene `phantom`, Premium 1.5 (second-hand)": SCENE.guard.max_force_N,
    }
    rows: list[tuple[str, ...]] = [
        (
            "force",
            f"hand, {hand:g} N/cm²",
            f"face, {face:g} N/cm²",
            f"older proposal: hand, {OLDER_HAND:g} N/cm²",
            f"older proposal: face, {OLDER_FACE:g} N/cm²",
        )
    ]
    for words, force in forces.items():
        cells = [
            f"{least_radius_m(force, limit) * 1e3:.1f} / {least_radius_m(force, limit, PEAK_OVER_MEAN) * 1e3:.1f} mm"
            for limit in (hand, face, OLDER_HAND, OLDER_FACE)
        ]
        rows.append((words, *cells))
    return table(rows)
