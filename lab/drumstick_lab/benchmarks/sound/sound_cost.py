"""Cost of the sound server's accuracy: drumstick lab sound-cost [--runs 7].

For each accuracy: the share of a core that a ringing 150 Hz head takes, ns per junction and step, and the pitch error
of the lowest mode (from the audio itself). Baseline in the same run: the same update written with numpy slices on a
square mesh of as many junctions. Interleaved runs, CPU time of the thread.
"""

import argparse
import dataclasses
import statistics
import time
from typing import Any

import numpy as np

from drumstick.drum.measurement.cost import f01_error_cents, ringing
from drumstick.parameters.drum import Drum, Mesh
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored

RATE_HZ = 48_000
FRAMES = RATE_HZ // 2
ACCURACIES = ("draft", "standard", "fine")


def scene_at(accuracy: str) -> Scene:
    roll = parse(shipped_text("roll"), "roll")
    return dataclasses.replace(roll, drum=Drum(t60_s=20.0), mesh=Mesh(accuracy=accuracy))  # pyright: ignore


def slices(junctions: int, steps: int) -> float:
    """CPU seconds for as many updates with numpy slices."""
    side = round(junctions**0.5) + 2
    u, u_old = np.random.default_rng(1).normal(size=(2, side, side)).astype(np.float32)
    begun = time.thread_time()
    for _ in range(steps):
        neighbour_sum = u[1:-1, :-2] + u[1:-1, 2:] + u[:-2, 1:-1] + u[2:, 1:-1]
        u_old[1:-1, 1:-1] = np.float32(0.499) * neighbour_sum - np.float32(0.998) * u_old[1:-1, 1:-1]
        u, u_old = u_old, u
    return time.thread_time() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    scenes = {accuracy: scene_at(accuracy) for accuracy in ACCURACIES}
    spent: dict[str, list[float]] = {a: [] for a in ACCURACIES}
    ratio: dict[str, list[float]] = {a: [] for a in ACCURACIES}
    size: dict[str, tuple[int, int]] = {}
    for _ in range(runs):
        for accuracy, scene in scenes.items():
            seconds, junctions, steps = ringing(scene, RATE_HZ, FRAMES)
            size[accuracy] = junctions, steps
            spent[accuracy].append(seconds)
            ratio[accuracy].append(seconds / slices(junctions, steps))
    rows: dict[str, Any] = {}
    for accuracy, scene in scenes.items():
        junctions, steps = size[accuracy]
        median = statistics.median(spent[accuracy])
        rows[accuracy] = {
            "junctions": junctions,
            "mesh_rate_Hz": round(steps * RATE_HZ / FRAMES),
            "share_of_core": median * RATE_HZ / FRAMES,
            "ns_per_junction_and_step": median / junctions / steps * 1e9,
            "ratio_to_numpy_slices": statistics.median(ratio[accuracy]),
            "f01_error_cents": f01_error_cents(scene, RATE_HZ),
        }
        print(accuracy, rows[accuracy])
    result = {
        "runs": runs,
        "f01_Hz": 150.0,
        "device_rate_Hz": RATE_HZ,
        "rows": rows,
    }
    stored.store("sound_cost", result)


if __name__ == "__main__":
    main()
