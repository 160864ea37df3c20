"""A scene's drum fitted to a recorded one: drumstick lab fit-to-recording KITS --scene FILE --to NAME --free KEY=LOW:HIGH ...

What published physics leaves open (a mallet's stiffness, a head's inner losses) is searched for, between limits that the caller
gives, until the drum's five strokes lie near the recorded ones by the measures of `beside_recordings`: the mean distance of
the band levels, how much 1-8 kHz rise with the blow, T60 by octave. NAME is one of the recordings to work with, or several
with commas: then their mean is sought. A key is the path in the scene's file, `mallet.mass_kg`. The search goes by steps
whose size is a share of the value, two keys at a time, and keeps what is nearer; it prints each find, ready to be written
into the file. The held-out recordings take no part.
"""

import argparse
import copy
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import (
    SceneError,
    as_tables,
    from_tables,
    parse,
    shipped_names,
    shipped_text,
)
from drumstick_lab.benchmarks.recordings.beside_recordings import (
    WORK,
    Measures,
    Numbers,
    distance,
    played,
    recorded,
    rise,
)
from drumstick_lab.measuring.made_beside import DRUM_SET, PLACE

_DEPTH_M = 1e-4  # where the mallet's force stays as it is while its exponent is moved
_SHARE = 0.25  # size of a step, as a share of the value
_RISE_WEIGHT, _T60_WEIGHT = 1.0, 2.0  # dB of distance for a dB of rise, for an octave of T60


class Free(NamedTuple):
    """One number to search for: its path in the scene's tables, and its limits."""

    path: tuple[str, ...]
    low: float
    high: float


def _free(text: str) -> Free:
    key, _, limits = text.partition("=")
    low, _, high = limits.partition(":")
    try:
        free = Free(tuple(key.split(".")), float(low), float(high))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not KEY=LOW:HIGH") from None
    if not 0.0 < free.low < free.high:
        raise argparse.ArgumentTypeError(f"{text!r}: 0 < LOW < HIGH, for steps are shares of the value")
    return free


def _table(tables: dict[str, Any], free: Free) -> dict[str, Any]:
    for part in free.path[:-1]:
        tables = tables[part]
    return tables


def _moved(tables: dict[str, Any], all_free: list[Free], random: np.random.Generator) -> dict[str, Any]:
    moved = copy.deepcopy(tables)
    for index in random.choice(len(all_free), min(2, len(all_free)), replace=False):
        free = all_free[index]
        table, key = _table(moved, free), free.path[-1]
        before = table[key]
        after = before * math.exp(_SHARE * random.standard_normal())
        table[key] = min(max(after, free.low), free.high)
        if free.path == ("mallet", "exponent"):
            table["stiffness_N_per_m_p"] *= _DEPTH_M ** (before - table[key])
    return moved


def _mean(drums: list[Measures]) -> Measures:
    # A recording of one stroke says how bright a drum is, not how it grows with the blow.
    several = [drum for drum in drums if len(drum.bands) > 1] or drums

    def level(of: Callable[[Measures], Numbers]) -> Numbers:
        middle = np.mean([of(drum).mean(axis=0) for drum in drums], axis=0)
        return np.mean([of(drum) - of(drum).mean(axis=0) for drum in several], axis=0) + middle

    return Measures(
        level(lambda drum: drum.bands),
        level(lambda drum: drum.thirds),
        level(lambda drum: drum.flatness),
        np.exp(np.nanmean(np.log([drum.t60_s for drum in drums]), axis=0)),
    )


def _parts(ours: Measures, real: Measures) -> tuple[float, float, float]:
    if len(real.bands) == 1:  # how bright the drum is on average, however that grows
        ours = ours._replace(bands=ours.bands.mean(axis=0, keepdims=True))
    octaves = np.abs(np.log2(ours.t60_s / real.t60_s))
    return (
        distance(ours.bands, real.bands),
        abs(rise(ours.bands) - rise(real.bands)),
        float(np.nanmean(octaves)),
    )


def _cost(parts: tuple[float, float, float]) -> float:
    return parts[0] + _RISE_WEIGHT * parts[1] + _T60_WEIGHT * parts[2]


def _scene(tables: dict[str, Any]) -> Scene | None:
    # None where a step leads to a scene that cannot be: the search goes on beside it.
    try:
        return from_tables(tables)
    except SceneError:
        return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kits", type=Path)
    parser.add_argument("--scene", required=True, help="a shipped name or a file")
    parser.add_argument("--to", required=True, help="recordings of WORK in beside_recordings, with commas")
    parser.add_argument("--free", type=_free, nargs="+", required=True, metavar="KEY=LOW:HIGH")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    kinds = {name: kind for kind, named in WORK.items() for name in named}
    names = args.to.split(",")
    real = _mean([recorded(args.kits, WORK[kinds[name]][name]) for name in names])
    text = shipped_text(args.scene) if args.scene in shipped_names() else Path(args.scene).read_text()
    first = parse(text, args.scene)
    place = PLACE if kinds[names[0]] in DRUM_SET else first.hand.orbit_radius
    best, parts = as_tables(first), _parts(played(first, place), real)
    random, end = np.random.default_rng(args.seed), time.monotonic() + args.seconds
    while True:
        numbers = " ".join(f"{'.'.join(f.path)}={_table(best, f)[f.path[-1]]:.4g}" for f in args.free)
        print(
            f"{_cost(parts):.2f}: {parts[0]:.1f} dB, rise {parts[1]:.1f}, T60 {parts[2]:.2f} octaves: {numbers}",
            flush=True,
        )
        while time.monotonic() < end:
            tables = _moved(best, args.free, random)
            scene = _scene(tables)
            if scene is None:
                continue
            found = _parts(played(scene, place), real)
            if _cost(found) < _cost(parts):
                best, parts = tables, found
                break
        else:
            return


if __name__ == "__main__":
    main()
