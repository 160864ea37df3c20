"""Lateness of the servo's ticks between two looks, by its own histogram."""

import json
from typing import Any

import numpy as np
from rig_process import Rig, ask

_LAST_BIN = 511


def histogram(session: Any, rig: Rig) -> "tuple[float, np.ndarray]":
    """Width of a bin, us, and how many ticks were so late, since the servo began."""
    found = json.loads(ask(session, rig.keys.doctor))["lateness"]
    return float(found["bin_us"]), np.array(found["ticks"], np.int64)


def lateness(before: np.ndarray, after: np.ndarray, bin_us: float) -> dict[str, Any]:
    """Percentiles of the ticks between two looks, us; null: beyond the histogram's last bin, 5.11 ms."""
    counts = after.copy()
    counts[: len(before)] -= before
    reached = np.cumsum(counts) / counts.sum()
    at = {
        name: float(bin_us * np.searchsorted(reached, share))
        for name, share in (("p50", 0.5), ("p99", 0.99), ("p99.9", 0.999))
    }
    at["max"] = float(bin_us * np.flatnonzero(counts)[-1])
    last_us = bin_us * _LAST_BIN  # it holds all that were later
    row: dict[str, Any] = {name: value if value < last_us else None for name, value in at.items()}
    return {**row, "ticks": int(counts.sum())}
