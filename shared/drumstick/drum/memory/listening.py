"""Levels of a drum: what is set while it plays, and how far they have come."""

from typing import NamedTuple

import numpy as np

from realtime.records import Record, Records, Rows, dtype_of


class ListenTargets(Record):
    """Values set while it plays: gain in dB, balance, share taken away."""

    listen_gain: float
    listen_pan: float
    listen_mute: float


class Levels(Record):
    """Factors of left and right at the beginning of the coming block, and the ones that they follow."""

    left: float
    right: float
    left_ahead: float
    right_ahead: float


TARGETS, LEVELS = dtype_of(ListenTargets), dtype_of(Levels)


class Listening(NamedTuple):
    """target, levels: (1,)."""

    target: Rows[ListenTargets]
    levels: Rows[Levels]


def as_it_comes() -> Listening:
    """At a gain of 1, in the middle. Allocates."""
    levels: Records = np.ones(1, LEVELS)
    return Listening(np.zeros(1, TARGETS), levels)
