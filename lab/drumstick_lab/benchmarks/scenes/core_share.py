"""Share of a core that each shipped scene's drum takes: drumstick lab core-share [--runs 5].

`ringing` is what `drumstick scene cost` says of the scene as it ships. `played`: the same drum under as many strokes a
second as a fast roll has, half of full scale at half radius, mallets included where it has one. Runs of all scenes take
turns; CPU time of the thread, per second of sound. Told beside them: the dearest quarter of a second while it is
played, for that is what a block has to keep up with; and `build_s`, processor seconds until the drum is there, each in
a process of its own, imports and kernels apart.
"""

import argparse
import importlib
import multiprocessing
import statistics
import time
from typing import Any

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine, size_of
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.engine import Engine
from drumstick.drum.measurement.cost import ringing
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick_lab.measuring import stored

RATE_HZ = 48_000
FRAMES = RATE_HZ // 4
STROKES_PER_S = 24
_BLOCK = 128


def played(scene: Scene) -> tuple[list[float], Engine]:
    """Shares of a core of four quarters of a second in which the drum is struck, after as many that do not count."""
    ring = StrikeRing()
    engine = build(scene, RATE_HZ, ring)
    blow = strike_for_speed(scene, 0.5 * scene.strike.full_scale_m_per_s, 0.5, 0.0)
    out = np.zeros((FRAMES // 6, 2), np.float32)
    shares: list[float] = []
    for _ in range(8):
        spent = 0.0
        for _ in range(6):  # a stroke at the beginning of each
            ring.push_blow(blow)
            begun = time.thread_time()
            render_all(engine, out, _BLOCK, 0)
            spent += time.thread_time() - begun
        shares.append(spent * RATE_HZ / FRAMES)
    return shares[4:], engine


def _built_s(name: str) -> float:
    for library in ("fft", "linalg", "special"):
        importlib.import_module(f"scipy.{library}")
    new_engine(Scene("imports what a mesh needs"), RATE_HZ, StrikeRing())
    scene = parse(shipped_text(name), name)
    begun = time.process_time()
    new_engine(scene, RATE_HZ, StrikeRing())
    return time.process_time() - begun


def main() -> None:
    """Measure all scenes, and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    scenes = {name: parse(shipped_text(name), name) for name in shipped_names()}
    found: dict[str, dict[str, list[float]]] = {
        name: {"ringing": [], "played": [], "dearest": []} for name in scenes
    }
    rows: dict[str, Any] = {}
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        built_s = dict(zip(scenes, pool.map(_built_s, scenes, chunksize=1), strict=True))
    for _ in range(runs):
        for name, scene in scenes.items():
            found[name]["ringing"].append(ringing(scene, RATE_HZ, FRAMES).cpu_s * RATE_HZ / FRAMES)
            shares, engine = played(scene)
            found[name]["played"].append(statistics.mean(shares))
            found[name]["dearest"].append(max(shares))
            is_modal = scene.modal is not None
            rows[name] = {"size": size_of(engine), "is_modal": is_modal, "build_s": built_s[name]}
    for name, row in rows.items():
        row |= {what: statistics.median(shares) for what, shares in found[name].items()}
        print(name, row)
    result = {
        "runs": runs,
        "rate_Hz": RATE_HZ,
        "strokes_per_s": STROKES_PER_S,
        "rows": rows,
    }
    stored.store("core_share", result)


if __name__ == "__main__":
    main()
