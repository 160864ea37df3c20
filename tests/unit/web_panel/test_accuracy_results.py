"""Results of `drumstick accuracy` as the page reads them: points in order, and nothing of a file that is none."""

import json
from pathlib import Path
from typing import Any

import pytest

from web_panel.accuracy_results import read

MACHINE = {"processor": "<b>a</b>", "date": "2026-01-01", "quick": False}


def written(path: Path, mesh: list[dict[str, Any]], stick: list[dict[str, Any]]) -> Path:
    path.write_text(json.dumps({"machine": MACHINE, "mesh": {"rows": mesh}, "stick": {"rows": stick}}))
    return path


def row(ns: float | None, cents: float | None, **more: Any) -> dict[str, Any]:
    return {"ns_per_sample": ns, "rms_cents": cents, **more}


def test_points_come_by_rising_cost_and_only_what_was_measured_here(tmp_path: Path) -> None:
    mesh = [
        row(30.0, 1.0), row(10.0, -4.0), row(20.0, None), row(None, 2.0), row(5.0, 0.0),
        row(1.0, 9.0, measured=False), row(2.0, 9.0, renderer="STK Mesh2D"), row(40.0, 0.5, renderer="mesh"),
    ]  # fmt: skip
    stick = [{"ns_per_s": 1e5, "error_contacts": 0.0}, {"ns_per_s": 1e6, "error_contacts": 1e-9}]
    found = read(written(tmp_path / "a.json", mesh, stick))
    assert found is not None
    assert [column.tolist() for column in found.pitch] == [[10.0, 30.0, 40.0], [4.0, 1.0, 0.5]]
    assert [column.tolist() for column in found.stick] == [[1e5, 1e6], [2.0**-52, 1e-9]]
    assert found.words == "<b>a</b>, 2026-01-01"


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "3", "null", "{}", '{"machine": 3}', "[" * 100_000, '{"machine": {}, "mesh": []}',
        json.dumps({"machine": MACHINE, "mesh": {"rows": [{}]}, "stick": {"rows": []}}),
        json.dumps({"machine": MACHINE, "mesh": {"rows": [row(1.0, "x")]}, "stick": {"rows": []}}),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_a_file_that_is_no_result_is_told_as_one(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError, match=r"a\.json cannot be read: ."):
        read(tmp_path / "a.json")


def test_no_file_is_none(tmp_path: Path) -> None:
    assert read(None) is None
    assert read(tmp_path / "missing.json") is None
    with pytest.raises(ValueError, match="cannot be read"):
        read(tmp_path)
