"""Mesh's part of `accuracy`: all rows have the same keys, numbers that can be numbers, and an origin."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drumstick_lab.accuracy import mesh, timing
from drumstick_lab.accuracy.peers import stored_peers, supercollider, windows
from drumstick_lab.accuracy.peers.heard import cents_heard, free_square, round_modes

KEYS = {
    "renderer", "scheme", "rim", "precision", "across", "junctions", "rate_Hz", "rms_cents", "worst_cents",
    "modes_found", "decay_error", "bandwidth_Hz", "ns_per_sample", "ratio", "measured",
}  # fmt: skip


@pytest.fixture
def without_programs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A PATH on which no program lies."""
    monkeypatch.setenv("PATH", str(tmp_path))
    return tmp_path


@pytest.fixture
def timed(monkeypatch: pytest.MonkeyPatch) -> list[set[str]]:
    """Rows that were timed together."""
    calls: list[set[str]] = []

    def in_turn(windows: dict[str, Any], rounds: int) -> dict[str, float]:
        calls.append(set(windows))
        return timing.in_turn(windows, rounds)

    monkeypatch.setattr(mesh, "in_turn", in_turn)
    return calls


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch, without_programs: Path, timed: list[set[str]]) -> dict[str, Any]:
    """The quick run with one small mesh, one small bank and two rounds."""
    monkeypatch.setattr(mesh, "_QUICK_DIVISORS", (12,))
    monkeypatch.setattr(mesh, "_QUICK_TOPS_Hz", (1000.0,))
    monkeypatch.setattr(mesh, "_QUICK_ROUNDS", 2)
    monkeypatch.setattr(mesh, "SCHEMES", {"limit": mesh.SCHEMES["limit"]})
    result: dict[str, Any] = {}
    for job in mesh.jobs(True, result):
        job.run()
    return result


def test_rows_are_complete_and_json(found: dict[str, Any]) -> None:
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["f01_Hz"] == 150.0
    assert found["device_rate_Hz"] == 48_000
    rows = found["rows"]
    assert all(row.keys() >= KEYS for row in rows)
    of_mesh = [(row["scheme"], row["rim"], row["precision"]) for row in rows if row["renderer"] == "mesh"]
    assert of_mesh == [("limit", rim, bits) for rim in ("weights", "none") for bits in ("float32", "float64")]
    assert [row["renderer"] for row in rows if row["renderer"] != "mesh"] == ["modal", *stored_peers.PEERS]
    for row in rows:
        assert row["ns_per_sample"] > 0.0
        assert row["ratio"] > 0.0
        if row["renderer"] in ("mesh", "modal"):
            assert row["measured"] is True
            assert row["modes_found"] == 20
            assert 0.0 < row["rms_cents"] < row["worst_cents"] < 60.0


def test_all_rows_are_timed_in_the_same_rounds(found: dict[str, Any], timed: list[set[str]]) -> None:
    measured = [row for row in found["rows"] if row["measured"]]
    assert timed == [{timing.SWEEP, *map(str, range(len(measured)))}]
    for row in measured:
        assert row["ns_per_sample"] / row["ratio"] == pytest.approx(found["yardstick_ns"][timing.SWEEP])


@pytest.mark.usefixtures("without_programs")
def test_missing_programs_are_told_by_stored_results() -> None:
    rows = {row["renderer"]: row for row in stored_peers.rows(True, rounds=1)}
    kept = stored_peers.stored()
    for name, row in rows.items():
        assert row["measured"] is False
        assert row["why"].startswith("not installed: ")
        assert row["of"] == f"{kept['machine']['date']}, {kept['machine']['processor']}"
        assert row["ns_per_sample"] == kept["rows"][name]["ns_per_sample"]


def test_a_program_that_fails_is_told_by_stored_results(
    without_programs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(windows.PACKAGES, "sc3-plugins-server", lambda: True)
    program = without_programs / "scsynth"
    program.write_text("#!/bin/sh\necho no plug-ins\nexit 1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{without_programs}{os.pathsep}/bin")
    monkeypatch.setattr(
        stored_peers,
        "PEERS",
        {"SuperCollider MembraneCircle": stored_peers.PEERS["SuperCollider MembraneCircle"]},
    )
    (row,) = stored_peers.rows(True, rounds=1)
    assert row["measured"] is False
    assert "no plug-ins" in row["why"]


def _peer(build: Any) -> stored_peers.Peer:
    return stored_peers.Peer((), "float32", 6.0, True, build)


@pytest.mark.parametrize("at", ["built", "first", "later"])
@pytest.mark.parametrize(
    "error",
    [
        ChildProcessError("no plug-ins"),
        ArithmeticError("overflow"),
        ValueError("no data"),
        IndexError("empty"),
    ],
)
def test_a_peer_that_fails_at_any_time_has_its_stored_row_and_the_others_are_measured(
    monkeypatch: pytest.MonkeyPatch, at: str, error: Exception
) -> None:
    runs: list[float] = []

    def fails() -> float:
        runs.append(1.0)
        if at == "first" or len(runs) > 2:
            raise error
        return 1.0

    def build(_folder: Path, _seconds: float) -> stored_peers.Point:
        if at == "built":
            raise error
        return stored_peers.Point(31, fails, None)

    works = _peer(lambda _folder, _seconds: stored_peers.Point(64, lambda: 5.0, None))
    monkeypatch.setattr(
        stored_peers, "PEERS", {"SuperCollider MembraneCircle": _peer(build), "Faust 8x8": works}
    )
    broken, whole = stored_peers.rows(True, rounds=3)
    assert broken["measured"] is False
    assert str(error) in broken["why"]
    assert broken["ns_per_sample"] == stored_peers.stored()["rows"][broken["renderer"]]["ns_per_sample"]
    assert whole["measured"] is True
    assert whole["ns_per_sample"] == 5.0


def test_a_program_that_hangs_is_ended(without_programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = without_programs / "scsynth"
    program.write_text("#!/bin/sh\nexec sleep 60\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{without_programs}{os.pathsep}/bin")
    monkeypatch.setattr(supercollider, "_MAX_S", 0.2)
    with pytest.raises(subprocess.TimeoutExpired):
        supercollider.response(without_programs, "MembraneCircle", 1.0)


def test_silence_has_no_modes() -> None:
    assert len(cents_heard(np.zeros(2**12), 48_000.0, [1.0, 2.0])) == 0


def test_stored_rows_have_every_peer() -> None:
    kept = stored_peers.stored()["rows"]
    assert set(kept) == set(stored_peers.PEERS)
    assert all(row.keys() >= KEYS - {"measured"} for row in kept.values())


def _response(ratios: list[float], cents: list[float]) -> np.ndarray:
    t = np.arange(2**16) / 48_000.0
    tones = [400.0 * ratio * 2.0 ** (off / 1200.0) for ratio, off in zip(ratios, cents, strict=True)]
    return sum(np.exp(-3.0 * t) * np.sin(2.0 * np.pi * f_Hz * t) for f_Hz in tones)  # type: ignore[return-value]


def test_modes_are_read_from_an_impulse_response() -> None:
    ratios = [1.0, 2.295, 3.598]
    found = cents_heard(_response(ratios, [0.0, -40.0, 25.0]), 48_000.0, ratios)
    assert found == pytest.approx([0.0, -40.0, 25.0], abs=0.5)


def test_modes_far_from_their_place_are_missing() -> None:
    ratios = [1.0, 2.295, 3.598]
    found = cents_heard(_response(ratios, [0.0, -400.0, 25.0]), 48_000.0, ratios)
    assert found == pytest.approx([0.0, 25.0], abs=0.5)


def test_ideal_ratios_of_the_peers_membranes() -> None:
    assert round_modes() == pytest.approx([1.0, 2.2954, 3.5985], abs=1e-3)
    square = free_square()
    assert len(square) == 20
    assert square[:6] == pytest.approx([1.0, 1.0, 2**0.5, 2.0, 2.0, 5**0.5])
