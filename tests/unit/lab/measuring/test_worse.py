"""`drumstick lab worse` of two folders of results: ratios to each one's yardstick."""

import json
from pathlib import Path
from typing import Any

import pytest

from drumstick_lab.benchmarks import worse
from drumstick_lab.checkout import RESULTS
from drumstick_lab.measuring.yardsticks import RATIOS, ratios


def _set(folder: Path, **results: Any) -> Path:
    folder.mkdir()
    for name, found in results.items():
        (folder / f"{name}.json").write_text(json.dumps(found), encoding="utf-8")
    return folder


def _start(seconds: float, imports_s: float) -> dict[str, Any]:
    row = {"strike_processor_s": seconds, "sound_processor_s": 2.0 * imports_s}
    return {"imports_s": imports_s, "rows": {"filled": row}}


def test_a_slower_machine_is_no_change_and_a_dearer_start_is_one(tmp_path: Path) -> None:
    old = _set(tmp_path / "old", first_start=_start(3.0, 0.2))
    slower = _set(tmp_path / "slower", first_start=_start(6.0, 0.4))
    dearer = _set(tmp_path / "dearer", first_start=_start(6.0, 0.2))
    assert worse.changes_of_sets(slower, old, 1.3) == (2, [], [])
    change = worse.Change(
        "first_start", "rows/filled/strike_processor_s", pytest.approx(15.0), pytest.approx(30.0)
    )
    assert worse.changes_of_sets(dearer, old, 1.3) == (2, [change], [])
    assert worse.changes_of_sets(old, dearer, 1.3)[1] == []
    assert len(worse.changes_of_sets(old, dearer, 1.3)[2]) == 1


def test_where_more_is_better_less_is_worse(tmp_path: Path) -> None:
    fast, slow = (
        _set(
            tmp_path / name, modal_bank={"lanes": {"8": [{"ns": {"ratio": ratio}, "pulses": {"ratio": 2.0}}]}}
        )
        for name, ratio in (("fast", 4.0), ("slow", 2.0))
    )
    assert [change.key for change in worse.changes_of_sets(slow, fast, 1.3)[1]] == ["lanes/8/0/ns/ratio"]
    assert worse.changes_of_sets(fast, slow, 1.3)[1] == []


def test_folders_without_a_common_ratio_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    empty = _set(tmp_path / "empty")
    monkeypatch.setattr("sys.argv", ["worse", str(empty), str(empty)])
    assert worse.main() == 2


@pytest.mark.parametrize("name", [name for name in RATIOS if (RESULTS / f"{name}.json").exists()])
def test_each_yardstick_is_in_the_stored_result(name: str) -> None:
    found = ratios(name, json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8")))
    for each in RATIOS[name]:
        begin = each.cost.partition("*")[0]
        assert [what for what in found if what.startswith(begin)], each
