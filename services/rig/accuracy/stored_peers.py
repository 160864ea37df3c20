"""Other programs' meshes as rows: measured where they are installed, else as they were measured elsewhere."""

import json
import subprocess
import tempfile
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rig.accuracy.peers import compiled, supercollider
from rig.accuracy.peers.heard import Numbers, cents_heard, free_square, round_modes
from rig.accuracy.peers.windows import missing, of_library, of_supercollider, versions
from rig.accuracy.timing import SWEEP, Window, in_turn, plain_sweep
from rig.this_machine import description

Row = dict[str, Any]
STORED = "stored_peers.json"
_CIRCLE = "MembraneCircle"
_ROUNDS, _QUICK_ROUNDS = 15, 3
_SECONDS, _QUICK_SECONDS = 4.0, 2.0
_HEARD_SAMPLES = 2**16
_HEARD_S = 3.0


class Point(NamedTuple):
    """A peer as it was built: its junctions, its window, and the cents of its modes or None."""

    junctions: int
    window: Window
    cents: Numbers | None


class Peer(NamedTuple):
    """What it needs, what its numbers are, junctions across, whether it is built within seconds; and building it."""

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
    """What the package brings: machine, packages, and rows by the peer's name."""
    text = (resources.files("rig.accuracy") / STORED).read_text(encoding="utf-8")
    return json.loads(text)


def _from_store(name: str, why: str) -> Row:
    kept = stored()
    of = f"{kept['machine']['date']}, {kept['machine']['processor']}"
    return kept["rows"][name] | {"measured": False, "of": of, "why": why}


def _point(peer: Peer, folder: Path, quick: bool) -> Point | str:
    # The peer as it was built, or why it was not.
    lacking = missing(peer.packages)
    if lacking:
        return f"not installed: {', '.join(lacking)}"
    if quick and not peer.soon:
        return "takes long to compile"
    try:
        return peer.build(folder, _QUICK_SECONDS if quick else _SECONDS)
    except (OSError, subprocess.CalledProcessError) as error:
        return f"cannot be run here: {error}"


def rows(quick: bool, rounds: int = 0) -> list[Row]:
    """One row a peer; the stored ones say of when and where they are, and why."""
    with tempfile.TemporaryDirectory() as name:
        built = {label: _point(peer, Path(name), quick) for label, peer in PEERS.items()}
        points = {peer: point for peer, point in built.items() if isinstance(point, Point)}
        windows = {SWEEP: plain_sweep()} | {peer: point.window for peer, point in points.items()}
        ns = in_turn(windows, rounds or (_QUICK_ROUNDS if quick else _ROUNDS)) if points else {}
    found: list[Row] = []
    for peer, point in built.items():
        if isinstance(point, Point):
            times = {"ns_per_sample": ns[peer], "ratio": ns[peer] / ns[SWEEP]}
            found.append(_row(peer, point) | times | {"measured": True})
        else:
            found.append(_from_store(peer, point))
    return found


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
