"""Evenness of drummers' hands: drumstick lab evenness FOLDER.

FOLDER is the Groove MIDI Dataset (Gillick, Roberts, Engel, Eck, Bamman, "Learning to Groove with Inverse Sequence
Transformations", ICML 2019, arXiv:1905.06118; CC BY 4.0; magenta.tensorflow.org/datasets/groove), unpacked: info.csv
and a folder for each of ten drummers, who play an electronic kit. MIDI files are read by mido (`pip install mido`), which
nothing else here needs.

Counted is whoever repeats one stroke: 16 intervals in a row on one surface (hi-hat, ride, snare), none of them more than
a quarter off their median. From each such block a line (the tempo's drift) is taken off the intervals, and off the
strokes the line and what every fourth stroke has in common (accents); what is left is the hand. Two hands may share a
surface: the files do not tell. The correlation of neighbours is negative where a stroke that came late by itself makes
one interval longer and the next shorter (Wing and Kristofferson 1973: between 0 and -0.5).
"""

import argparse
import csv
import itertools
import math
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick_lab.measuring import stored

SURFACES = {
    "hi-hat": (22, 26, 42, 46),
    "ride": (51, 53, 59),
    "snare": (37, 38, 40),
}  # notes of the kit's module
RATES_HZ = (1.0, 3.0, 5.0, 7.0, 9.0, 20.0)
BLOCK = 16  # intervals
_OFF = 0.25
_BAR = 4

_Floats = npt.NDArray[np.float64]


class Block(NamedTuple):
    """Unevenness of BLOCK repeated strokes."""

    rate_Hz: float
    interval_percent: float
    """Standard deviation of the intervals about their line, of their mean; 6 % too much where they are anticorrelated."""
    neighbours: float
    """Correlation of each interval with the next; -0.13 for independent ones, in so short a block."""
    velocity_dB: float
    """Standard deviation of 20 lg of the strokes' MIDI velocities, without drift and accents."""


def block_of(times_s: Sequence[float] | _Floats, velocities: Sequence[float] | _Floats) -> Block:
    """Judge BLOCK + 1 strokes at `times_s` with `velocities` above 0."""
    intervals = np.diff(np.asarray(times_s, float))
    at = np.arange(intervals.size)
    left = intervals - np.polyval(np.polyfit(at, intervals, 1), at)
    levels = 20.0 * np.log10(np.asarray(velocities, float)[:BLOCK])
    common = np.stack(
        (np.arange(BLOCK), *(np.arange(BLOCK) % _BAR == k for k in range(_BAR))), axis=1
    ).astype(float)
    uneven = levels - common @ np.linalg.lstsq(common, levels, rcond=None)[0]
    mean_s, power = float(intervals.mean()), float(left @ left)
    return Block(
        1.0 / mean_s,
        100.0 * math.sqrt(power / (intervals.size - 2)) / mean_s,
        float(left[1:] @ left[:-1]) / power if power > 0.0 else 0.0,
        math.sqrt(float(uneven @ uneven) / (BLOCK - 1 - _BAR)),
    )


def blocks(strokes: Sequence[tuple[float, int]]) -> Iterator[Block]:
    """Each run of repeated strokes in (time in s, velocity), in pieces of BLOCK intervals that share no interval."""
    times, velocities = np.array(strokes, float).reshape(-1, 2).T
    intervals, at = np.diff(times), 0
    while at + BLOCK <= intervals.size:
        piece = intervals[at : at + BLOCK]
        middle = float(np.median(piece))
        wild = np.flatnonzero(np.abs(piece - middle) > _OFF * middle)
        if wild.size:
            at += int(wild[0]) + 1
            continue
        yield block_of(times[at : at + BLOCK + 1], velocities[at : at + BLOCK + 1])
        at += BLOCK


def _strokes(mido: Any, file: Path) -> dict[str, list[tuple[float, int]]]:
    found: dict[str, list[tuple[float, int]]] = {surface: [] for surface in SURFACES}
    now_s = 0.0
    for message in mido.MidiFile(file):
        now_s += message.time
        if message.type == "note_on" and message.velocity > 0:
            for surface, notes in SURFACES.items():
                if message.note in notes:
                    found[surface].append((now_s, message.velocity))
    return found


def judged(mido: Any, folder: Path) -> dict[tuple[str, str], list[Block]]:
    """(drummer, surface) -> their blocks. Raises OSError."""
    found: dict[tuple[str, str], list[Block]] = {}
    with (folder / "info.csv").open(encoding="utf-8") as table:
        for row in csv.DictReader(table):
            for surface, strokes in _strokes(mido, folder / row["midi_filename"]).items():
                found.setdefault((row["drummer"], surface), []).extend(blocks(strokes))
    return found


def rows(found: dict[tuple[str, str], list[Block]]) -> list[dict[str, Any]]:
    """For each surface and range of rates: how many blocks of how many drummers, and their 10th, 50th, 90th per cent."""
    made: list[dict[str, Any]] = []
    for surface in SURFACES:
        for low, high in itertools.pairwise(RATES_HZ):
            of = [
                (drummer, block)
                for (drummer, on), those in found.items()
                if on == surface
                for block in those
                if low <= block.rate_Hz < high
            ]
            if len(of) < 5:  # too few to say anything
                continue
            table = np.array([block for _, block in of])
            percentiles = np.percentile(table, (10.0, 50.0, 90.0), axis=0)
            made.append(
                {"surface": surface, "from_Hz": low, "to_Hz": high}
                | {"blocks": len(of), "drummers": len({drummer for drummer, _ in of})}
                | {name: percentiles[:, k].round(2).tolist() for k, name in enumerate(Block._fields) if k}
            )
    return made


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("folder", type=Path, help="the unpacked data set, with info.csv in it")
    folder = arguments.parse_args().folder
    if not (folder / "info.csv").is_file():
        arguments.error(
            f"{folder} holds no info.csv: unpack the Groove MIDI Dataset (MIDI only, 3 MB) and name its folder"
        )
    try:
        mido: Any = import_module("mido")
    except ImportError:
        arguments.error("reading MIDI files needs mido: pip install mido")
    found = rows(judged(mido, folder))
    for row in found:
        print(*(f"{name} {value}" for name, value in row.items()), sep=", ")
    result = {"data_set": "Groove MIDI Dataset 1.0.0", "intervals_a_block": BLOCK, "rows": found}
    stored.store("evenness", result)


if __name__ == "__main__":
    main()
