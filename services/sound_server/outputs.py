"""Output pairs: by which two channels of the device each rig is heard, and single pickups or microphones of it.

Every sound leaves by one pair, so the sum of all pairs is the mix: what has a pair of its own is taken out of its
rig's, and what is named nowhere is on channels 1 and 2. Names on one pair are mixed there. Any thread.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

from protocol.keys import checked_rig

MAX_CHANNELS = 64
DEFAULT_PAIR = (1, 2)
_SOURCE = re.compile(r"(pickup|microphone)-([1-9]|1[0-6])")
_PAIR = re.compile(r"([0-9]{1,3})-([0-9]{1,3})")


class OutputPair(NamedTuple):
    """Rig, its pickup-1, microphone-1 ..., or empty for the rest of its drum; left and right channel, from 1."""

    rig: str
    source: str
    left: int
    right: int

    @property
    def name(self) -> str:
        """Name as it is written: RIG or RIG/SOURCE."""
        return f"{self.rig}/{self.source}" if self.source else self.rig


Outputs = tuple[OutputPair, ...]


def outputs_of(text: str) -> Outputs:
    """Pairs of `RIG=1-2,RIG/microphone-1=3-4`; ValueError in words."""
    return tuple(_pair_of(part.strip()) for part in text.split(","))


def _pair_of(text: str) -> OutputPair:
    name, _, channels = text.partition("=")
    rig, slash, source = name.strip().partition("/")
    found = _PAIR.fullmatch(channels.strip())
    if found is None:
        raise ValueError(f"{text!r}: write RIG=1-2, or RIG/microphone-1=3-4; commas between them")
    if slash and not _SOURCE.fullmatch(source):
        raise ValueError(
            f"{text!r}: after the / comes pickup-1 to pickup-16, or microphone-1 to microphone-16"
        )
    return OutputPair(checked_rig(rig), source, int(found[1]), int(found[2]))


def check(outputs: Outputs) -> None:
    """ValueError for a name that comes twice, and for channels that are no pair."""
    names = [pair.name for pair in outputs]
    for pair in outputs:
        if names.count(pair.name) > 1:
            raise ValueError(f"{pair.name} has two pairs: give it one")
        for channel in (pair.left, pair.right):
            if not 1 <= channel <= MAX_CHANNELS:
                raise ValueError(f"{pair.name}: channel {channel} is outside 1 .. {MAX_CHANNELS}")
        if pair.left == pair.right:
            raise ValueError(f"{pair.name}: left and right are both channel {pair.left}; give two")


def channels_of(outputs: Outputs) -> int:
    """Channels that the device must have; 2 where nothing is said."""
    return max([2, *(max(pair.left, pair.right) for pair in outputs)])


def channel_names(outputs: Outputs) -> list[str]:
    """Names of all channels, from 1, by what leaves there: `RIG.left`; with + between those that are mixed."""
    found: list[list[str]] = [[] for _ in range(channels_of(outputs))]
    for pair in outputs:
        found[pair.left - 1].append(f"{pair.name}.left")
        found[pair.right - 1].append(f"{pair.name}.right")
    return ["+".join(names) or f"channel-{number}" for number, names in enumerate(found, 1)]


class RigOutputs(NamedTuple):
    """Pairs of one rig, channels from 0: of its mix, and of what has its own, by name."""

    mix: tuple[int, int]
    apart: dict[str, tuple[int, int]]

    def known(self, there: Sequence[str]) -> tuple[str, ...]:
        """Names of these that have a pair of their own."""
        return tuple(name for name in self.apart if name in there)

    def pairs(self, names: Sequence[str]) -> list[tuple[int, int]]:
        """The mix's, and those of these names."""
        return [self.mix, *(self.apart[name] for name in names)]


def of_rig(outputs: Outputs, rig: str) -> RigOutputs:
    """This rig's."""
    pairs = {pair.source: (pair.left - 1, pair.right - 1) for pair in outputs if pair.rig == rig}
    mix = pairs.pop("", (DEFAULT_PAIR[0] - 1, DEFAULT_PAIR[1] - 1))
    return RigOutputs(mix, pairs)
