"""A stored result says where it comes from, and a page whether that is still so."""

import json
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drumstick_lab import checkout
from drumstick_lab.checkout import DOCS, ROOT
from drumstick_lab.measuring import catalogue, provenance, source_hash, stored
from drumstick_lab.measuring.catalogue import CATALOGUE, Entry, sources_of
from drumstick_lab.programs import module_of

LAB = ROOT / "lab" / "drumstick_lab"
# Told elsewhere than on a page that is made of results: what fuzzing and mutants found is in docs/decisions and tests.
ON_NO_PAGE = {"fuzz", "mutation", "mutation_tests"}


@pytest.fixture
def code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A checkout with one module, which the result `one` measures, and an empty folder of results."""
    (tmp_path / "shared").mkdir()
    (tmp_path / "results").mkdir()
    module = tmp_path / "shared" / "law.py"
    monkeypatch.setattr(checkout, "RESULTS", tmp_path / "results")
    for each in (source_hash, stored):
        monkeypatch.setattr(each, "ROOT", tmp_path)
    for name in ("one", "two", "three"):
        monkeypatch.setitem(catalogue.CATALOGUE, name, Entry(("shared",), 1.0, command=("soak",)))
    _write(module, '"""A law."""\n\nx = 1\n')
    yield module
    _forget()


def _forget() -> None:
    source_hash._hash_of.cache_clear()
    provenance.most_common_machine.cache_clear()


def _write(module: Path, text: str) -> None:
    module.write_text(text, encoding="utf-8")
    os.utime(module, (1.0, 1.0))  # long before the run began
    _forget()


def _marks(name: str) -> str:
    return " ".join(provenance.marks(name, stored.read(name)))


def test_a_result_is_stale_once_the_code_has_changed_not_its_comments(code: Path) -> None:
    stored.store("one", {"rows": 1})
    assert _marks("one") == ""
    _write(code, '"""A law, in other words."""\n\nx = 1  # as measured\n')
    assert _marks("one") == ""
    _write(code, '"""A law."""\n\nx = 2\n')
    assert _marks("one") == "Stale: the code has changed since."
    assert "**Stale: the code has changed since.**" in provenance.heading("## One", "one")[2]
    stored.store("one", {"rows": 1})
    assert _marks("one") == ""


def test_another_file_beside_it_makes_it_stale_too(code: Path) -> None:
    stored.store("one", {})
    _write(code.with_name("loop.c"), "int x;")
    assert "Stale" in _marks("one")


def test_code_that_was_edited_meanwhile_was_measured_by_nobody(code: Path) -> None:
    code.write_text("x = 3\n", encoding="utf-8")
    assert stored.store("one", {})["machine"]["sources"] is None
    assert _marks("one") == "May be stale: its version is not known."


def test_what_is_not_of_the_machine_of_most_is_marked(code: Path) -> None:
    for name in ("one", "two", "three"):
        result = stored.store(name, {})
    result["machine"] |= {"processor": "another"}
    stored.path("three").write_text(json.dumps(result), encoding="utf-8")
    _forget()
    assert [_marks(name) for name in ("one", "two", "three")] == ["", "", "From another machine than most."]


def test_what_most_have_is_told_once_and_a_result_tells_what_differs(code: Path) -> None:
    for name in ("one", "two", "three"):
        result = stored.store(name, {})
    result["machine"] |= {"processor": "another"}
    stored.path("three").write_text(json.dumps(result), encoding="utf-8")
    _forget()
    machine = result["machine"]
    assert f"Python {machine['python']}" in provenance.usual_machine()
    assert f"{machine['date']}, machine {provenance.USUAL}, " in provenance.line("one")
    assert f"{machine['date']}, another, otherwise {provenance.USUAL}, " in provenance.line("three")
    assert "Python" not in provenance.line("one") + provenance.line("three")


def test_what_is_made_by_hand_says_so_and_why(code: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stored.store("one", {})
    assert "by hand" not in provenance.line("one")
    monkeypatch.setitem(
        catalogue.CATALOGUE, "one", catalogue.CATALOGUE["one"]._replace(by_hand="needs a drummer")
    )
    assert provenance.line("one").endswith(
        " *Made by hand, not in the run of all the others: needs a drummer.*"
    )


def test_a_result_says_where_and_of_what_it_was_made(code: Path) -> None:
    machine = stored.store("one", {"machine": {"old": True}, "rows": 1}, quick=False)["machine"]
    told = {
        "date", "processor", "cores", "system", "python", "packages", "real_time_priority", "commit", "sources",
        "load_before", "load_after", "elapsed_s", "quick",
    }  # fmt: skip
    assert set(machine) == told
    assert stored.read("one") == {"machine": machine, "rows": 1}
    assert [path.name for path in checkout.RESULTS.iterdir()] == ["one.json"]


def test_the_peers_that_a_run_stores_beside_the_code_do_not_make_it_edited_code(code: Path) -> None:
    root = code.parent.parent
    for path in ("lab/drumstick_lab/accuracy/peers/stored_peers.json", "services/servo.py", "tests/one.py"):
        (root / path).parent.mkdir(parents=True)
        (root / path).write_text("1\n", encoding="utf-8")
    git = ("git", "-C", str(root), "-c", "user.name=a", "-c", "user.email=a@b.invalid")
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "--no-verify", "-m", "All of it"]):
        subprocess.run([*git, *words], check=True)
    (root / "lab/drumstick_lab/accuracy/peers/stored_peers.json").write_text("2\n", encoding="utf-8")
    assert re.fullmatch("[0-9a-f]{12}", str(stored.commit()))
    code.write_text("x = 4\n", encoding="utf-8")
    assert str(stored.commit()).endswith("-dirty")


@pytest.mark.parametrize("old", [{}, {"machine": {}}, {"machine": {"date": "2026-01-01", "packages": {}}}])
def test_what_an_old_result_does_not_say_is_not_known(code: Path, old: dict[str, Any]) -> None:
    stored.path("one").write_text(json.dumps(old), encoding="utf-8")
    line = provenance.line("one")
    assert re.search(r"not known: .*kernel.*version, real-time priority, load\.\*", line)
    assert "**May be stale: its version is not known.**" in line


def test_a_number_that_is_none_is_not_stored(code: Path) -> None:
    with pytest.raises(ValueError, match="JSON"):
        stored.store("one", {"rows": float("nan")})
    assert not stored.exists("one")


def test_every_stored_result_is_in_the_catalogue_and_has_its_program_and_its_sources() -> None:
    assert {path.stem for path in (ROOT / "lab" / "results").glob("*.json")} <= set(CATALOGUE)
    for name, entry in CATALOGUE.items():
        started = entry.started_by(name)
        if started[0] == "lab":
            module_of(started[1])
        for path in sources_of(name):
            assert list(source_hash.files_of(path)), path


def test_every_program_stores_by_the_one_way_what_the_catalogue_knows() -> None:
    texts = [path.read_text(encoding="utf-8") for path in (LAB / "benchmarks").rglob("*.py")]
    found = {name for text in texts for name in re.findall(r'stored\.store\("(\w+)"', text)}
    assert found == set(CATALOGUE) - {"soak"}
    assert not [text for text in texts if "RESULTS /" in text]


def test_every_result_is_on_a_page_with_its_line() -> None:
    pages = "\n".join(path.read_text(encoding="utf-8") for path in DOCS.glob("*.md"))
    missing = [name for name in CATALOGUE if stored.exists(name) and provenance.line(name) not in pages]
    assert set(missing) <= ON_NO_PAGE
