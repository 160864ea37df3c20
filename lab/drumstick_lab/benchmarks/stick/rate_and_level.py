"""Rate and level that were asked for, judged by the exact simulation: drumstick lab rate-and-level [--targets 200].

Targets are drawn from 4 .. 80 Hz and levels 0.02 .. 1, by their logarithms, over every shipped scene that has a steady roll: both, or one
of the two while the other is to stay, each from what the target before has left, as on a stage. Each is met or
refused. Judge is `ds.simulate`, which knows nothing of the inverse: a stick with these values is thrown as in the
scene, and its last 32 contacts of 300 have to have the rate within 1 % and the level within 0.5 dB. The nearest that a refusal
names is judged in the same way, and the envelope has to let it in.
"""

import argparse
import math
from typing import Any

import numpy as np

import drumstick as ds
from drumstick.analysis.inverse import Inverse, Roll, Unreachable, moved
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.table import Refusal, table_of, with_changes
from drumstick.stick.law import law_of
from drumstick_lab.measuring import stored

RATES_HZ, LEVELS = (4.0, 80.0), (0.02, 1.0)
RATE_TOLERANCE, LEVEL_TOLERANCE_dB = 0.01, 0.5
CONTACTS, JUDGED = 300, 32
SEED = 20071


def rolling() -> dict[str, Scene]:
    """Shipped scenes that have a steady roll."""
    found: dict[str, Scene] = {}
    for name in ds.scene_names():
        scene = ds.scene(name)
        try:
            Inverse(scene).present(law_of(scene))
        except Refusal:
            continue
        found[name] = scene
    return found


def departure(scene: Scene, values: dict[str, float], rate_Hz: float, level: float) -> tuple[float, float]:
    """Distance of the played roll from this rate, as a share, and from this level, dB: the worst of the last contacts.

    Infinite where no such roll is left.
    """
    played = ds.simulate(ds.scene(scene.name, **values), CONTACTS / rate_Hz)
    last = played.contacts[-JUDGED - 1 :]
    if played.end != "time" or len(last) <= JUDGED:
        return math.inf, math.inf
    rates = 1.0 / np.diff(last["t_in_s"])
    levels = 20.0 * np.log10(last["level"] / level)
    return float(np.max(np.abs(rates / rate_Hz - 1.0))), float(np.max(np.abs(levels)))


def require_allowed(scene: Scene, values: dict[str, float]) -> None:
    """Raise Refusal where the scene's own envelope does not let these values in."""
    envelope.require(with_changes(law_of(scene), table_of(scene), values), envelope.Limits.of(scene))


def of_scene(scene: Scene, targets: int, chance: np.random.Generator) -> list[dict[str, Any]]:
    """A row for each target, in the order in which they were asked for."""
    inverse = Inverse(scene)
    now = inverse.present(law_of(scene))
    rows: list[dict[str, Any]] = []
    for number in range(targets):
        lows, highs = np.log([[RATES_HZ[0], LEVELS[0]], [RATES_HZ[1], LEVELS[1]]])
        drawn = [float(each) for each in np.exp(chance.uniform(lows, highs))]
        rate = drawn[0] if number % 3 != 1 else None
        level = drawn[1] if number % 3 != 2 else None
        wanted_Hz, wanted_level = rate or now.rate_Hz, level or now.level
        found: Roll
        try:
            found = now = inverse.towards(inverse.present(now.law), rate, level)
            refused = ""
        except Unreachable as refusal:
            found, refused = refusal.nearest, str(refusal)
            wanted_Hz, wanted_level = found.rate_Hz, found.level
        values = moved(found.law)
        require_allowed(scene, values)
        of_rate, of_level_dB = departure(scene, values, wanted_Hz, wanted_level)
        rows.append(
            {
                "asked": {"rate": rate, "level": level},
                "refused": refused,
                "values": values,
                "rate_off": of_rate,
                "level_off_dB": of_level_dB,
                "good": of_rate <= RATE_TOLERANCE and of_level_dB <= LEVEL_TOLERANCE_dB,
            }
        )
    return rows


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts of one scene, the worst departures of what was met and of the nearest, and all that failed."""

    def worst(name: str, refused: bool) -> float | None:
        return max(
            (row[name] for row in rows if bool(row["refused"]) is refused and row["good"]), default=None
        )

    return {
        "targets": len(rows),
        "met": sum(row["good"] and not row["refused"] for row in rows),
        "refused_with_a_nearest_that_plays": sum(row["good"] and bool(row["refused"]) for row in rows),
        "worst_rate_off": worst("rate_off", refused=False),
        "worst_level_off_dB": worst("level_off_dB", refused=False),
        "worst_rate_off_of_nearest": worst("rate_off", refused=True),
        "worst_level_off_dB_of_nearest": worst("level_off_dB", refused=True),
        "failed": [
            {name: None if value == math.inf else value for name, value in row.items()}
            for row in rows
            if not row["good"]
        ],
    }


def main() -> None:
    """Ask, judge, tell and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=200, help="of all scenes together")
    targets = parser.parse_args().targets
    chance, scenes = np.random.default_rng(SEED), rolling()
    rows: dict[str, Any] = {}
    for number, (name, scene) in enumerate(scenes.items()):
        share = targets * (number + 1) // len(scenes) - targets * number // len(scenes)
        rows[name] = summary(of_scene(scene, share, chance))
        print(name, rows[name], flush=True)
    result = {
        "rate_tolerance": RATE_TOLERANCE,
        "level_tolerance_dB": LEVEL_TOLERANCE_dB,
        "targets": sum(row["targets"] for row in rows.values()),
        "rows": rows,
    }
    stored.store("rate_and_level", result)


if __name__ == "__main__":
    main()
