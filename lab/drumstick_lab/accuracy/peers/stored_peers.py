"""Other programs' meshes as rows: measured where they are installed, else as they were measured elsewhere."""

import json
import math
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drumstick_lab.accuracy.peers import compiled, supercollider
from drumstick_lab.accuracy.peers.heard import Numbers, cents_heard, free_square, round_modes
from drumstick_lab.accuracy.peers.windows import missing, of_library, of_supercollider, versions
from drumstick_lab.accuracy.timing import SWEEP, Window, in_turn, plain_sweep
from drumstick_lab.measuring.this_machine import description

Row = dict[str, Any]
STORED = "stored_peers.json"
_CIRCLE = "MembraneCircle"
_SECONDS, _QUICK_SECONDS = 2.0, 1.0  # of SuperCollider's score: a window as short as its start allows
_HEARD_SAMPLES = 2**16
_HEARD_S = 3.0
# What another program or its library may come to: none of it may end the run.
_FAILURES = (OSError, subprocess.SubprocessError, ArithmeticError, LookupError, ValueError, AttributeError)


class Point(NamedTuple):
    """A peer as it was built: its junctions, its window, and the cents of its modes or None."""

    junctions: int
    window: Window
    cents: Numbers | None


class Peer(NamedTuple):
    """A peer: its needs, its numbers, junctions across, whether it is built within seconds; and building it."""

    packages: tuple[str, ...]
    precision: str
    across: float
    soon: bool
    build: Callable[[Path, float], Point]


def _stk(folder: Path, _seconds: float) -> Point:
    library = compiled.stk(folder)
    heard = library.response(_HEARD_SAMPLES)
    return Point(
        library.junctions, of_library(library), cents_heard(heard, supercollider.RATE_HZ, free_square())
    )


def _faust(folder: Path, _seconds: float) -> Point:
    library = compiled.faust(folder, 8)
    return Point(library.junctions, of_library(library), None)


def _supercollider(folder: Path, seconds: float) -> Point:
    heard = supercollider.response(folder, _CIRCLE, _HEARD_S)
    cents = cents_heard(heard, supercollider.RATE_HZ, round_modes())
    return Point(supercollider.shape(_CIRCLE)[0], of_supercollider(folder, _CIRCLE, seconds), cents)


PEERS: dict[str, Peer] = {
    "STK Mesh2D": Peer(("libstk-dev", "g++"), "float64", 11.0, True, _stk),
    "Faust 8x8": Peer(("faust", "g++"), "float32", 8.0, False, _faust),
    f"SuperCollider {_CIRCLE}": Peer(
        ("supercollider-server", "sc3-plugins-server"), "float32", 6.0, True, _supercollider
    ),
}


def _row(name: str, point: Point) -> Row:
    cents = point.cents if point.cents is not None and len(point.cents) else None
    return {
        "renderer": name,
        "scheme": None,
        "rim": None,
        "precision": PEERS[name].precision,
        "across": PEERS[name].across,
        "junctions": point.junctions,
        "rate_Hz": float(supercollider.RATE_HZ),
        "rms_cents": None if cents is None else float(np.sqrt(np.mean(cents**2))),
        "worst_cents": None if cents is None else float(np.abs(cents).max()),
        "f01_cents": None,
        "modes_found": 0 if cents is None else len(cents),
        "decay_error": None,
        "bandwidth_Hz": None,
    }


def stored() -> dict[str, Any]:
    """Results that the package brings: machine, packages, and rows by the peer's name."""
    text = (resources.files("drumstick_lab.accuracy.peers") / STORED).read_text(encoding="utf-8")
    return json.loads(text)


def _from_store(name: str, why: str) -> Row:
    kept = stored()
    of = f"{kept['machine']['date']}, {kept['machine']['processor']}"
    return kept["rows"][name] | {"measured": False, "of": of, "why": why}


def _lacks(peer: Peer, quick: bool) -> str:
    # Why it is not even tried; empty where it is.
    lacking = missing(peer.packages)
    if lacking:
        return f"not installed: {', '.join(lacking)}"
    return "takes long to compile" if quick and not peer.soon else ""


class Peers:
    """Installed peers, built in `folder`. Time their `windows` while it is there; `rows` then covers all.

    One that fails, when it is built or in any round, has the stored row and the reason.
    """

    def __init__(self, folder: Path, quick: bool) -> None:
        self._points: dict[str, Point] = {}
        self._why = {name: why for name, peer in PEERS.items() if (why := _lacks(peer, quick))}
        for name, peer in PEERS.items():
            if name in self._why:
                continue
            try:
                self._points[name] = peer.build(folder, _QUICK_SECONDS if quick else _SECONDS)
            except _FAILURES as error:
                self._fails(name, error)

    @property
    def windows(self) -> dict[str, Window]:
        """Windows by name; a failed peer counts as infinitely slow."""
        return {name: partial(self._run, name) for name in self._points}

    def rows(self, ns: Mapping[str, float]) -> list[Row]:
        """One a peer, by the times of the windows and of SWEEP; the stored ones say of when and where, and why."""
        return [
            _from_store(name, self._why[name])
            if name in self._why
            else _row(name, self._points[name])
            | {"ns_per_sample": ns[name], "ratio": ns[name] / ns[SWEEP], "measured": True}
            for name in PEERS
        ]

    def _run(self, name: str) -> float:
        if name in self._why:
            return math.inf
        try:
            return self._points[name].window()
        except _FAILURES as error:
            self._fails(name, error)
            return math.inf

    def _fails(self, name: str, error: Exception) -> None:
        self._why[name] = f"cannot be run here: {type(error).__name__}: {error}"


def rows(quick: bool, rounds: int) -> list[Row]:
    """Rows of the peers alone."""
    with tempfile.TemporaryDirectory() as folder:
        peers = Peers(Path(folder), quick)
        return peers.rows(in_turn({SWEEP: plain_sweep()} | peers.windows, rounds))


def store(rounds: int) -> None:
    """Measure all, and write them to the package's own file. ValueError if one cannot be measured here."""
    measured = rows(False, rounds)
    if not all(row["measured"] for row in measured):
        raise ValueError("; ".join(row["why"] for row in measured if not row["measured"]))
    kept = {
        "machine": description(),
        "packages": versions(),
        "rows": {row["renderer"]: {k: v for k, v in row.items() if k != "measured"} for row in measured},
    }
    Path(__file__).with_name(STORED).write_text(
        json.dumps(kept, indent=1, allow_nan=False) + "\n", encoding="utf-8"
    )
