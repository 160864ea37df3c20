"""`drumstick lab measure`: one program after the other, what failed is told, what is done is left out."""

import sys
from pathlib import Path

import pytest

from drumstick_lab import checkout
from drumstick_lab.benchmarks import measure
from drumstick_lab.checkout import OTHER_RESULTS
from drumstick_lab.measuring.catalogue import CATALOGUE

STORES = "from drumstick_lab.measuring import stored; stored.store({!r}, {{}})"
FAILS = "print('it begins'); raise SystemExit('no device')"


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Python text of each program by its result, in place of the real ones; results go into a folder of the test."""
    texts: dict[str, str] = {}
    monkeypatch.setattr(measure, "command_of", lambda name: [sys.executable, "-c", texts[name]])
    monkeypatch.setattr(checkout, "RESULTS", tmp_path)
    monkeypatch.setattr(measure, "ROOT", tmp_path)
    monkeypatch.setenv(OTHER_RESULTS, str(tmp_path))
    return texts


def test_one_that_fails_is_told_at_the_end_and_the_others_are_stored(
    programs: dict[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    programs |= {"door": FAILS, "composed": STORES.format("composed"), "wire": "pass"}
    asked = ["door", "composed", "wire", "--out", str(tmp_path)]
    assert measure.main(asked) == 1
    said = capsys.readouterr().out
    assert "3 to measure, 0 are done" in said
    assert "FAILED door: exit status 1\n  it begins\n  no device\n" in said
    assert "FAILED wire: it ended well, but its result is: not stored" in said
    assert measure.state("composed") == "done"
    # The same command goes on from there; what is done is measured again only where that is asked for.
    programs |= {"door": STORES.format("door"), "composed": FAILS, "wire": STORES.format("wire")}
    assert measure.main(asked) == 0
    assert "2 to measure, 1 are done" in capsys.readouterr().out
    assert measure.main([*asked, "--again"]) == 1
    assert "FAILED composed" in capsys.readouterr().out


def test_one_that_hangs_is_ended(tmp_path: Path) -> None:
    why = measure._run([sys.executable, "-c", "import signal; signal.pause()"], tmp_path / "said", 0.5)
    assert why == "ended after 0 s"


@pytest.mark.parametrize("words", [["soak"], ["no-such-result"]])
def test_what_is_made_by_hand_or_unknown_is_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        measure.main(words)
    assert ended.value.code == 2


def test_the_list_measures_nothing_and_says_why_some_are_made_by_hand(
    programs: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert measure.main([]) == measure.main(["--all", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 * len(CATALOGUE)
    assert sum("by hand: " in line for line in lines) == 2 * sum(bool(e.by_hand) for e in CATALOGUE.values())


def test_a_time_that_is_stored_is_told_before_the_estimate(programs: dict[str, str], tmp_path: Path) -> None:
    assert measure.expected_s("door") == CATALOGUE["door"].about_s
    (tmp_path / "door.json").write_text('{"machine": {"elapsed_s": 7.5}}', encoding="utf-8")
    assert measure.expected_s("door") == 7.5
