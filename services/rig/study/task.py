"""A study's task: a TOML file with the blocks of one session, in their order (docs/study.md).

Every number has a unit in its key. Any thread.
"""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from protocol.messages import STICK
from realtime.regular_file import read_text
from rig.exit_status import usage_error

_MAX_BYTES = 200_000
_COUNT_IN = 4
# Clicks are strikes on the rig's drum, which takes no more of one player (docs/osc.md); strikes may be faster.
_MAX_CLICKS_Hz = 20.0

SYNCHRONISATION, CONTINUATION, FREE, COUNT_IN = "synchronisation", "continuation", "free", "count_in"
Words = Annotated[str, Meta(min_length=1, max_length=200)]
Rate = Annotated[float, Meta(gt=0.0, le=50.0)]


class Block(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One block: what is played on, at which rate, for how long, and what the metronome does.

    `tempo_per_min` or `rate_Hz`: strikes asked for; without either the rate is free. `strikes` or `duration_s`: length.
    `source`: whose strikes count, `stick` or the way that they come: `osc`, `midi`, `zenoh`. `metronome`: `throughout`,
    `stops` after `sounded` strikes (synchronisation, then continuation), or `none`; a click falls on each `every`th
    strike, and before the block on `count_in` more. `rest_s`: pause before the block, s.
    """

    name: Words
    condition: Words
    source: Annotated[str, Meta(pattern="^(stick|osc|midi|zenoh)( [ -~]{1,60})?$")] = STICK
    tempo_per_min: Annotated[float, Meta(gt=0.0, le=3000.0)] | None = None
    rate_Hz: Rate | None = None
    strikes: Annotated[int, Meta(ge=2, le=100_000)] | None = None
    duration_s: Annotated[float, Meta(gt=0.0, le=3600.0)] | None = None
    metronome: Literal["throughout", "stops", "none"] = "none"
    sounded: Annotated[int, Meta(ge=2)] | None = None
    every: Annotated[int, Meta(ge=1, le=64)] = 1
    count_in: Annotated[int, Meta(ge=0, le=64)] | None = None
    rest_s: Annotated[float, Meta(ge=0.0, le=3600.0)] = 0.0

    @property
    def interval_s(self) -> float | None:
        """Time from strike to strike that is asked for; None where the rate is free."""
        if self.tempo_per_min is not None:
            return 60.0 / self.tempo_per_min
        return None if self.rate_Hz is None else 1.0 / self.rate_Hz

    @property
    def count(self) -> int:
        """Strikes that are asked for; 0 where the rate is free."""
        if self.interval_s is None:
            return 0
        return self.strikes or max(round((self.duration_s or 0.0) / self.interval_s), 1)

    @property
    def seconds(self) -> float:
        """Length of the block without its count-in."""
        return self.duration_s or 0.0 if self.interval_s is None else self.count * self.interval_s

    @property
    def counted_in(self) -> int:
        """Clicks before the block."""
        return (_COUNT_IN if self.interval_s else 0) if self.count_in is None else self.count_in

    @property
    def beats(self) -> int:
        """First strikes of the block that the metronome leads."""
        return {"throughout": self.count, "stops": self.sounded or 0}.get(self.metronome, 0)

    def clicks(self) -> list[int]:
        """Strikes at which a click sounds, counted from 0; below 0 those of the count-in."""
        count_in = [-k * self.every for k in range(self.counted_in, 0, -1)]
        return count_in + list(range(0, self.beats, self.every))


class Task(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Blocks of a session, and the metronome's click: a strike of this level at x, y on the rig's drum."""

    name: Words
    block: Annotated[list[Block], Meta(min_length=1, max_length=1000)]
    click_level: Annotated[float, Meta(gt=0.0, le=1.0)] = 0.3
    click_x: Annotated[float, Meta(ge=-0.7, le=0.7)] = 0.6
    click_y: Annotated[float, Meta(ge=-0.7, le=0.7)] = 0.0


def read(path: Path) -> Task:
    """The task of this file, checked. Raises CommandError, which says what is wrong and where."""
    try:
        tables = tomllib.loads(read_text(path, _MAX_BYTES))
    except OSError as error:
        usage_error(f"--task {path}: cannot be read: {error.strerror}")
    except UnicodeDecodeError:
        usage_error(f"--task {path}: not UTF-8 text")
    except tomllib.TOMLDecodeError as error:
        usage_error(f"--task {path}: not TOML: {error}")
    try:
        task = msgspec.convert(tables, Task)
    except msgspec.ValidationError as error:
        usage_error(f"--task {path}: {error} (blocks are counted from 0)")
    for number, block in enumerate(task.block, 1):
        if wrong := _mistake(block):
            usage_error(f"--task {path}: block {number}, {block.name!r}: {wrong}")
    return task


def _mistake(block: Block) -> str | None:
    rate = block.interval_s
    length = (block.strikes is None) + (block.duration_s is None)
    if block.tempo_per_min is not None and block.rate_Hz is not None:
        return "give tempo_per_min or rate_Hz, not both"
    if length != 1:
        return "give strikes or duration_s, " + ("not both" if length == 0 else "to say how long it is")
    if rate is None and (block.duration_s is None or block.metronome != "none" or block.count_in):
        return "without tempo_per_min or rate_Hz the rate is free: give duration_s, and neither metronome nor count_in"
    if (block.sounded is not None) != (block.metronome == "stops"):
        return 'sounded and metronome = "stops" belong together: after so many strikes the metronome stops'
    if block.metronome != "none" and block.beats < 2:
        return "the metronome needs two strikes or more to lead"
    if block.metronome == "stops" and block.beats > block.count - 2:
        return f"sounded = {block.beats} leaves fewer than 2 of {block.count} strikes to go on alone"
    if rate is not None and block.clicks() and rate * block.every < 1.0 / _MAX_CLICKS_Hz:
        return f"more than {_MAX_CLICKS_Hz:g} clicks a second: let only one in `every` strikes have one"
    return None
