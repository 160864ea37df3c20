"""What the mesh's part of `accuracy` tells: all rows have the same keys, numbers that can be numbers, and an origin."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.accuracy import mesh, stored_peers
from rig.accuracy.peers import windows
from rig.accuracy.peers.heard import cents_heard, free_square, round_modes

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
def found(monkeypatch: pytest.MonkeyPatch, without_programs: Path) -> dict[str, Any]:
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


@pytest.mark.usefixtures("without_programs")
def test_missing_programs_are_told_by_stored_results() -> None:
    rows = {row["renderer"]: row for row in stored_peers.rows(True)}
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
    (row,) = stored_peers.rows(True)
    assert row["measured"] is False
    assert "no plug-ins" in row["why"]


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


def test_peers_that_are_there_are_measured() -> None:
    """Whatever is installed here; Faust's compiler takes too long for a quick run."""
    rows = {row["renderer"]: row for row in stored_peers.rows(True, rounds=1)}
    for name, peer in stored_peers.PEERS.items():
        assert rows[name]["measured"] is (peer.soon and not windows.missing(peer.packages))
    assert rows["SuperCollider MembraneCircle"]["modes_found"] >= 2
    assert rows["STK Mesh2D"]["modes_found"] == 20
    assert 5.0 < rows["STK Mesh2D"]["rms_cents"] < 100.0
    assert rows["Faust 8x8"]["rms_cents"] is None
