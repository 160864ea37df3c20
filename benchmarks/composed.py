"""What composing costs: python benchmarks/composed.py [--rounds 100].

A scene without effects gets its step by leaving out, when it is compiled, whatever it does not name. Here is the step
that one would write by hand for just such a drum: a sweep of the mesh, the blows that last, two pickups, a look now and
then whether it still sounds. It stands for the same drum when it takes as many overlapping blows (32); with a single
blow it tells what those cost. All use the same row kernel and must give the same samples, or the script stops. Thread
CPU time, windows of a millisecond in turn, of each the best; and the median of the rounds' ratios.
"""

import argparse
import dataclasses
import json
import math
import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import numpy as np
import numpy.typing as npt
from bare_mesh import RATE_HZ, start, timed
from machine import description

from drumstick.scene import Scene
from realtime.float_mode import flush_denormals, restore
from realtime.jit import Record, Records, njit
from realtime.lent import lend
from sound_server.build import new_engine
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.excitation import POOL, PULSE, begin
from sound_server.membrane.heads import aligned
from sound_server.membrane.lanes import WIDTH
from sound_server.membrane.places import corners_of
from sound_server.membrane.rows import step_of
from sound_server.membrane.strip import LEFT
from sound_server.step import step

RESULT = HERE / "results" / "composed.json"
GOAL = 1.03
WINDOW_UPDATES = 4e6
PLACE = (0.3, 0.2)
F01_HZ = (300.0, 150.0, 75.0)
Floats = npt.NDArray[np.float32]
_strip = step_of(WIDTH, LEFT)


class Drum(NamedTuple):
    """The drum by hand: what a step needs, and no more."""

    planes: Floats
    weights: Floats
    strips: npt.NDArray[np.int64]
    stride: int
    now_gain: np.float32
    then_gain: np.float32
    blows: Records  # (n,) of PULSE, all at one junction
    junction: int
    force_gain: float
    ears: npt.NDArray[np.int64]
    gains: Floats


@njit()
def by_hand(drum: Drum, out: Floats) -> None:
    planes = drum.planes
    mode = flush_denormals()
    loudest = np.float32(0.0)
    for at in range(out.shape[0]):
        now, then = planes[at & 1], planes[1 - (at & 1)]
        for k in range(drum.strips.shape[0]):
            _strip(
                now, then, drum.weights, drum.stride, drum.strips[k, 0], drum.strips[k, 1], drum.strips[k, 2],
                drum.strips[k, 3], drum.now_gain, drum.then_gain, None, None, None, None, None, None, None, None,
            )  # fmt: skip
        for k in range(drum.blows.shape[0]):
            blow: Record = drum.blows[k]
            if blow.age < blow.duration:
                scale = math.pi / blow.duration
                begun = min(max(blow.age, 0.0), blow.duration)
                ended = min(max(blow.age + 1.0, 0.0), blow.duration)
                force = blow.peak / scale * (math.cos(scale * begun) - math.cos(scale * ended))
                then[drum.junction] += np.float32(drum.force_gain * force)
                blow.age += 1.0
        left = right = 0.0
        for k in range(drum.ears.shape[0]):
            moved = float(then[drum.ears[k]] - now[drum.ears[k]])
            left += drum.gains[k, 0] * moved
            right += drum.gains[k, 1] * moved
        out[at, 0], out[at, 1] = left, right
        if at % 4096 == 4095:
            for k in range(then.shape[0]):
                loudest = max(loudest, abs(then[k]), abs(now[k]))
    restore(mode)


@njit()
def composed(engine: Engine, out: Floats) -> None:
    engine = lend(engine)
    mode = flush_denormals()
    for at in range(out.shape[0]):
        left, right = step(engine)
        out[at, 0], out[at, 1] = left, right
    restore(mode)


def drum_of(engine: Engine, x: float, y: float, blows: int) -> Drum:
    """The same drum as the engine, moving alike, with planes of its own."""
    control, head = engine.control[0], engine.head
    planes = aligned(head.planes.shape)
    planes[:] = head.planes
    places, shares = corners_of(head, x, y)
    junction = places[int(np.argmax(shares))]
    return Drum(
        planes=planes,
        weights=head.weights,
        strips=head.strips,
        stride=int(head.grid["stride"][0]),
        now_gain=control["now_gain"],
        then_gain=control["then_gain"],
        blows=np.zeros(blows, PULSE),
        junction=junction,
        force_gain=float(head.weights[junction]) * float(control["force_gain"]),
        ears=engine.ears,
        gains=engine.ear_gains,
    )


def measured(f01_Hz: float, rounds: int) -> dict[str, Any]:
    scene = Scene("drum")
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, f01_Hz=f01_Hz, t60_s=20.0))
    engine = new_engine(scene, RATE_HZ, StrikeRing())
    start(engine.head)
    drums = [drum_of(engine, *PLACE, blows) for blows in (POOL, 1)]
    junctions = int(np.count_nonzero(engine.head.weights))
    steps = 2 * max(10, round(WINDOW_UPDATES / junctions / 2))
    sounds = [np.zeros((steps, 2), np.float32) for _ in range(3)]
    calls: tuple[Callable[[], None], ...] = (
        lambda: composed(engine, sounds[0]),
        lambda: by_hand(drums[0], sounds[1]),
        lambda: by_hand(drums[1], sounds[2]),
    )

    def struck() -> None:
        # A blow of four steps at the beginning of each window.
        for drum in drums:
            begin(drum.blows, 0, *PLACE, 0.0, 4.0, 1e-3)
        control = engine.control[0]
        control["begun"] = begin(engine.pulses, int(control["begun"]), *PLACE, 0.0, 4.0, 1e-3)

    times: list[tuple[float, ...]] = []
    for _ in range(rounds + 1):
        struck()
        times.append(tuple(timed(call) for call in calls))
        assert sounds[0].any()
        assert all(np.array_equal(sounds[0], other) for other in sounds[1:]), "not the same drum"
    ns = [[spent / steps * 1e9 for spent in column] for column in zip(*times[1:], strict=True)]
    found: dict[str, Any] = {"f01_Hz": f01_Hz, "junctions": junctions, "composed_ns": min(ns[0])}
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
    result = {"machine": description(), "rounds": rounds, "rows": rows}
    RESULT.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
