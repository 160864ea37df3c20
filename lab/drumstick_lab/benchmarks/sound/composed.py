"""Cost of composing a drum's step of its effects: drumstick lab composed [--rounds 100].

A scene without effects gets its step by leaving out, when it is compiled, whatever it does not name. Here is the step
that one would write by hand for just such a drum: a sweep of the mesh, the blows that last, two pickups, a look now and
then whether it still sounds. It stands for the same drum when it takes as many overlapping blows (32); with a single
blow it tells what those cost. All use the same row kernel and must give the same samples, or the script stops. Thread
CPU time, windows of a millisecond in turn, of each the best; and the median of the rounds' ratios.
"""

import argparse
import dataclasses
import statistics
from typing import Any

from drumstick.drum.memory.pulses import POOL
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.by_hand import GOAL, Race
from drumstick_lab.measuring import stored

F01_HZ = (300.0, 150.0, 75.0)


def measured(f01_Hz: float, rounds: int) -> dict[str, Any]:
    scene = Scene("drum")
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, f01_Hz=f01_Hz, t60_s=20.0))
    race = Race(scene, (POOL, 1))
    ns = list(zip(*race.run(rounds), strict=True))
    found: dict[str, Any] = {"f01_Hz": f01_Hz, "junctions": race.junctions, "composed_ns": min(ns[0])}
    for name, own in (("by_hand", ns[1]), ("by_hand_one_blow", ns[2])):
        found[f"{name}_ns"] = min(own)
        found[f"over_{name}"] = min(ns[0]) / min(own)
        found[f"over_{name}_median"] = statistics.median(a / b for a, b in zip(ns[0], own, strict=True))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=100)
    rounds = parser.parse_args().rounds
    rows = [measured(f01_Hz, rounds) for f01_Hz in F01_HZ]
    for row in rows:
        print(
            f"{row['junctions']:6d} junctions: composed {row['composed_ns']:.0f} ns a step, by hand"
            f" {row['by_hand_ns']:.0f}: {row['over_by_hand']:.3f} (median {row['over_by_hand_median']:.3f});"
            f" for one blow {row['by_hand_one_blow_ns']:.0f}: {row['over_by_hand_one_blow']:.3f}"
        )
        if row["over_by_hand"] > GOAL:
            print(f"  above the goal: {GOAL}")
    result = {"rounds": rounds, "rows": rows}
    stored.store("composed", result)


if __name__ == "__main__":
    main()
