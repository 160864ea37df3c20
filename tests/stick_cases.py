"""The stored reference cases as scenes, and one contact or flight at a time."""

import csv
from pathlib import Path

from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact

REFERENCE = Path(__file__).parent / "physics" / "drumstick" / "reference"
RELEASE = {"zero": "paper", "force": "unilateral"}
# Sets A and E of the design's parameter table, by the names of the reference files.
STICK_A = Stick(0.015, 5000.0, 1.3, 20.0, 0.1, -0.02, "paper")
# Held at the surface, by a pulse that fades more slowly than the contact swings back: found by search, its numbers
# became too small to tell a sign, 13 s after it had come to rest.
BALANCED = (
    Stick(0.016, 3328.0, 2.81, 54.6, 0.2586, 0.0, "paper"),
    Pulse(0.2966, 0.01822, "entry", -1, "ignore"),
)


def rows(name: str) -> list[dict[str, str]]:
    """The rows of one reference file."""
    with (REFERENCE / name).open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def scene(stick: Stick, pulse: Pulse | None = None) -> Scene:
    """A scene of these two."""
    return Scene("case", stick=stick, effects={} if pulse is None else {"pulse": pulse})


def cycle_scene(row: dict[str, str]) -> Scene:
    """The scene of a row of limit_cycles.csv."""
    numbers = [float(row[key]) for key in ("m", "K_coll", "R_in", "K_hand", "R_out", "z_ss")]
    stick = Stick(*numbers, release=RELEASE[row["release"]])  # pyright: ignore[reportArgumentType]
    trigger = row["trigger"]
    pulse = Pulse(float(row["dv"]), float(row["tau"]), trigger, int(row["sign"]))  # pyright: ignore
    return scene(stick, pulse)


def advance_by(law: Records, motion: Records, duration_s: float) -> None:
    """Carry the motion on, through whatever happens."""
    gone = 0.0
    while gone < duration_s and motion["outcome"][0] == exact.MOVING:
        gone += exact.advance(law[0], motion[0], duration_s - gone)[1]


def events(
    law: Records, motion: Records, duration_s: float, step_s: float | None = None
) -> list[tuple[int, float, float, float]]:
    """(event, time, z, v) of everything that happens in `duration_s`, in one go or in steps."""
    found: list[tuple[int, float, float, float]] = []
    step = duration_s if step_s is None else step_s
    count = 0
    while count * step < duration_s and motion["outcome"][0] == exact.MOVING:
        left = min(step, duration_s - count * step)
        gone = 0.0
        while gone < left and motion["outcome"][0] == exact.MOVING:
            event, moved = exact.advance(law[0], motion[0], left - gone)
            gone += moved
            if event != exact.HORIZON:
                found.append((event, count * step + gone, float(motion["z"][0]), float(motion["v"][0])))
        count += 1
    return found


def until(
    played: Scene, v_m_per_s: float, wanted: int, longest_s: float = 5.0
) -> tuple[Records, float] | None:
    """Start at z = 0 with this speed; the motion at the first `wanted` event and its time, None if it never comes."""
    law, motion, t = law_of(played), thrown(played, v_m_per_s), 0.0
    while t < longest_s and motion["outcome"][0] == exact.MOVING:
        event, moved = exact.advance(law[0], motion[0], longest_s - t)
        t += moved
        if event == wanted:
            return motion, t
    return None
