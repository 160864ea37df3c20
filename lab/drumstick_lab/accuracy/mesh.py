"""Error of a head's modes, and its cost: the mesh's schemes, the bank of modes, and other programs' meshes.

Errors are of the first twenty modes, pairs counted twice, relative to the lowest, whose own error is told beside them
(`f01_cents`): a rim without weights puts the whole head out of tune, not only its overtones. All rows are timed in the
same rounds: neighbours on the processor come and go within seconds, and rows of other seconds could not be compared.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drumstick_lab.accuracy.drums.heads import (
    SCHEMES,
    DEVICE_RATE_Hz,
    HeadAt,
    Rim,
    head_at,
    plain_step,
    plain_window,
    played_step,
    played_window,
)
from drumstick_lab.accuracy.drums.modal_bank import F01_Hz, banks
from drumstick_lab.accuracy.drums.modes import Poles, bandwidth, cents_off, decay_error, measured, patterns_of
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.peers import stored_peers
from drumstick_lab.accuracy.timing import SWEEP, Window, in_turn, plain_sweep

Row = dict[str, Any]
Measured = list[tuple[Row, Window]]
_DIVISORS, _QUICK_DIVISORS = (1, 2, 3, 4, 6, 8, 12), (2, 4, 8)
_TOPS_Hz, _QUICK_TOPS_Hz = (2000.0, 5000.0, 10000.0, 17000.0), (5000.0, 10000.0)
_ROUNDS, _QUICK_ROUNDS = 40, 15


def errors(poles: Poles, due_s: float) -> Row:
    """Errors of a row's modes: `poles` of the first twenty, T60 as it is due."""
    off = cents_off(poles.f_Hz, due_s)
    return {
        "rms_cents": float(np.sqrt(np.mean(off**2))),
        "worst_cents": float(np.abs(off).max()),
        "f01_cents": float(1200.0 * np.log2(poles.f_Hz[0] / F01_Hz)),
        "modes_found": len(off),
        "decay_error": decay_error(poles.t60_s, due_s),
    }


def _of_head(scheme: str, rim: Rim, divisor: int) -> Measured:
    head: HeadAt = head_at(scheme, rim, divisor)
    patterns, due_s = patterns_of(head.lattice), head.scene.drum.t60_s
    common: Row = {
        "renderer": "mesh",
        "scheme": scheme,
        "rim": rim,
        "across": head.lattice.across,
        "junctions": head.lattice.junctions,
        "rate_Hz": DEVICE_RATE_Hz / divisor,
        "bandwidth_Hz": bandwidth(head.scheme) / head.step_s,
        "measured": True,
    }
    ways = {"float32": (played_step, played_window), "float64": (plain_step, plain_window)}
    return [
        (
            common | {"precision": precision} | errors(measured(step(head), patterns, head.step_s), due_s),
            window(head),
        )
        for precision, (step, window) in ways.items()
    ]


def _time(cases: Measured, quick: bool, rounds: int) -> tuple[list[Row], float]:
    # Notes what each case costs, all beside other programs in turn; those programs' rows, and ns of the sweep.
    with tempfile.TemporaryDirectory() as folder:
        peers = stored_peers.Peers(Path(folder), quick)
        windows: dict[str, Window] = {SWEEP: plain_sweep()} | peers.windows
        windows |= {str(at): window for at, (_, window) in enumerate(cases)}
        ns = in_turn(windows, rounds)
    for at, (row, _) in enumerate(cases):
        row |= {"ns_per_sample": ns[str(at)], "ratio": ns[str(at)] / ns[SWEEP]}
    return peers.rows(ns), ns[SWEEP]


def jobs(quick: bool, found: dict[str, Any]) -> Iterator[Job]:
    """Notes f01_Hz, device_rate_Hz, rows, and yardstick_ns at last. Some 15 s if quick, else a minute or two; as much
    again to compile."""
    rows: list[Row] = []
    cases: Measured = []
    found |= {"f01_Hz": F01_Hz, "device_rate_Hz": DEVICE_RATE_Hz, "rows": rows}
    rounds = _QUICK_ROUNDS if quick else _ROUNDS
    divisors = _QUICK_DIVISORS if quick else _DIVISORS

    def note(more: Measured) -> None:
        cases.extend(more)
        rows.extend(row for row, _ in more)  # without its cost so far

    def of_scheme(scheme: str, rim: Rim) -> Job:
        def run() -> None:
            note([case for divisor in divisors for case in _of_head(scheme, rim, divisor)])

        return Job(f"mesh: {scheme}, {'weights at the rim' if rim == 'weights' else 'no weights'}", run)

    def of_bank() -> None:
        note(
            [
                (bank.row | errors(bank.poles, bank.t60_s), bank.window)
                for bank in banks(_QUICK_TOPS_Hz if quick else _TOPS_Hz)
            ]
        )

    def time() -> None:
        others, sweep_ns = _time(cases, quick, rounds)
        rows.extend(others)
        found["yardstick_ns"] = {SWEEP: sweep_ns}

    for scheme in SCHEMES:
        yield of_scheme(scheme, "weights")
        if not quick or scheme == "limit":
            yield of_scheme(scheme, "none")
    yield Job("bank of modes", of_bank)
    yield Job("other programs' meshes, and all in turn", time)
