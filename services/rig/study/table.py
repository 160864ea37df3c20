"""The table of a study: a row for each strike, and a row for each block and phase, from the logs. Any thread."""

import csv
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drumstick.analysis.timing import Timing, matched, timing
from rig.study.session_log import Attempt, Session, Strike
from rig.study.task import CONTINUATION, COUNT_IN, FREE, SYNCHRONISATION, Block

AFTER = "after"
Cell = str | int | float | bool | None
Row = Mapping[str, Cell]
_KEYS = (
    "player", "session", "begun_at", "task", "block", "block_name", "condition", "attempt", "whole",
    "scene", "target_interval_ms", "phase",
)  # fmt: skip
STRIKE_COLUMNS = (
    *_KEYS, "source", "counts", "t_s", "interval_ms", "beat", "asynchrony_ms", "level", "speed_m_per_s", "x", "y",
)  # fmt: skip
BLOCK_COLUMNS = (
    *_KEYS, "source", "metronome", *(each.name for each in fields(Timing)),
    "click_late_worst_ms", "lost", "arrival_ms", "output_latency_ms",
)  # fmt: skip


class Phase(NamedTuple):
    """A phase of a block: its strikes that count, in order, its beats, s from the block's first due strike."""

    name: str
    strikes: list[Strike]
    times_s: list[float]
    beats_s: list[float]


def phases(attempt: Attempt, block: Block) -> list[Phase]:
    """Phases of a block that are measured, in order; one without strikes too."""
    named = [SYNCHRONISATION] if block.beats else []
    if block.beats < block.count or block.interval_s is None:
        named.append(FREE if block.interval_s is None else CONTINUATION)
    return [_phase(name, attempt, block) for name in named]


def phase_of(strike: Strike, attempt: Attempt, block: Block) -> str:
    """Name of the phase in which a strike fell: a half interval before a due strike its time begins."""
    t_s, interval_s = (strike.t_ns - attempt.begin.first_ns) * 1e-9, block.interval_s or 0.0
    if t_s < -interval_s / 2.0:
        return COUNT_IN
    if t_s >= block.seconds - interval_s / 2.0:
        return AFTER
    if t_s < (block.beats - 0.5) * interval_s:
        return SYNCHRONISATION
    return FREE if block.interval_s is None else CONTINUATION


def _phase(name: str, attempt: Attempt, block: Block) -> Phase:
    strikes = sorted(
        (each for each in attempt.strikes if each.counts and phase_of(each, attempt, block) == name),
        key=lambda each: each.t_ns,
    )
    first_ns = attempt.begin.first_ns
    times_s = [(each.t_ns - first_ns) * 1e-9 for each in strikes]
    return Phase(name, strikes, times_s, _beats_s(attempt, block) if name == SYNCHRONISATION else [])


def _beats_s(attempt: Attempt, block: Block) -> list[float]:
    # A beat is where its click sounded. One without a click of its own lies evenly between the clicks before and after
    # it, and after the last one goes on from there: so beats are in order however late a click was.
    interval_s = block.interval_s or 0.0
    clicks = [(each.strike, (each.t_ns - attempt.begin.first_ns) * 1e-9) for each in attempt.clicks]
    numbers, sounded_s = zip(*clicks, strict=True) if clicks else ((0,), (0.0,))
    ends = (numbers[0], sounded_s[0]), (numbers[-1], sounded_s[-1])
    beats = np.arange(block.beats)
    found = np.interp(beats, numbers, sounded_s)
    for (number, at_s), outside in zip(ends, (beats < numbers[0], beats > numbers[-1]), strict=True):
        found[outside] = at_s + (beats[outside] - number) * interval_s
    return found.tolist()


def block_rows(head: Session, attempts: list[Attempt]) -> Iterator[Row]:
    """A row for each block and phase of a session. A block that was left off has no measures."""
    for attempt in attempts:
        block, end = head.task.block[attempt.begin.block - 1], attempt.end
        late_ms = [(each.t_ns - each.due_ns) * 1e-6 for each in attempt.clicks]
        for phase in phases(attempt, block):
            measures: Row = {}
            if end is not None:
                measures = asdict(
                    timing(
                        phase.times_s,
                        phase.beats_s,
                        interval_s=block.interval_s,
                        levels=[each.level for each in phase.strikes],
                        speeds_m_per_s=[each.speed_m_per_s for each in phase.strikes],
                    )
                )
            yield {
                **_keys(head, attempt, phase.name),
                "source": block.source.partition(" ")[0],
                "metronome": block.metronome,
                **measures,
                "click_late_worst_ms": max(late_ms, default=None),
                "lost": None if end is None else end.lost,
                "arrival_ms": None if end is None else end.arrival_ms,
                "output_latency_ms": None if end is None else end.output_latency_ms,
            }


def strike_rows(head: Session, attempts: list[Attempt]) -> Iterator[Row]:
    """A row for each strike of a session, those of blocks that were left off too."""
    for attempt in attempts:
        block = head.task.block[attempt.begin.block - 1]
        beside = {id(strike): cells for phase in phases(attempt, block) for strike, cells in _beside(phase)}
        for strike in sorted(attempt.strikes, key=lambda each: each.t_ns):
            yield {
                **_keys(head, attempt, phase_of(strike, attempt, block)),
                "source": strike.source,
                "counts": strike.counts,
                "t_s": (strike.t_ns - attempt.begin.first_ns) * 1e-9,
                "level": strike.level,
                "speed_m_per_s": strike.speed_m_per_s,
                "x": strike.x,
                "y": strike.y,
                **beside.get(id(strike), {}),
            }


def _beside(phase: Phase) -> Iterator[tuple[Strike, Row]]:
    # Each strike's interval from the one before, its beat (from 1) and asynchrony.
    chosen = matched(phase.times_s, phase.beats_s) if phase.beats_s else np.empty(0, int)
    beats = {int(strike): beat for beat, strike in enumerate(chosen) if strike >= 0}
    for k, (strike, t_s) in enumerate(zip(phase.strikes, phase.times_s, strict=True)):
        beat = beats.get(k)
        yield (
            strike,
            {
                "interval_ms": 1e3 * (t_s - phase.times_s[k - 1]) if k else None,
                "beat": None if beat is None else beat + 1,
                "asynchrony_ms": None if beat is None else 1e3 * (t_s - phase.beats_s[beat]),
            },
        )


def _keys(head: Session, attempt: Attempt, phase: str) -> dict[str, Cell]:
    begin = attempt.begin
    block = head.task.block[begin.block - 1]
    return {
        "player": head.player,
        "session": head.session,
        "begun_at": head.begun_at,
        "task": head.task.name,
        "block": begin.block,
        "block_name": block.name,
        "condition": block.condition,
        "attempt": begin.attempt,
        "whole": attempt.end is not None,
        "scene": begin.scene,
        "target_interval_ms": None if block.interval_s is None else 1e3 * block.interval_s,
        "phase": phase,
    }


def write(path: Path, columns: tuple[str, ...], rows: list[Row]) -> None:
    """Write a CSV file, 0600; one that is there is replaced when the new one is whole. Raises OSError."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows([_text(row.get(name)) for name in columns] for row in rows)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _text(cell: Cell) -> str:
    # NaN and None are an empty cell.
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    if isinstance(cell, bool):
        return str(cell).lower()
    return f"{cell:.10g}" if isinstance(cell, float) else str(cell)
