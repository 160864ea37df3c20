"""The model of the permission to push, searched whole by spin: no force after a panic or a fault without an arm."""

import re
import subprocess
from pathlib import Path

import pytest

from model.permission_model import MODEL, model

pytestmark = pytest.mark.needs("spin", "gcc")

PROPERTY = "assert(!(MAY_PUSH(state) && due))"
LAST_WORD = "held = (before != NONE -> LAST_WORD(before) : FREE)"
BORN_HELD = "block[own].held = PANICKED\n"

# What may be forgotten, and the lines of the model that remember it, with what stands there then.
FORGOTTEN = {
    "a servo that starts anew does not ask whether the one before was held": {LAST_WORD: "held = FREE"},
    "it asks only before its own block is in place": {
        "before = place;": "before = place; held = (place != NONE -> LAST_WORD(place) : FREE);",
        LAST_WORD: "true",
    },
    "its block says nothing before the last word of the old one": {BORN_HELD: "skip\n"},
    "its block says nothing before the first tick has ended": {
        BORN_HELD: "skip\n",
        "block[own].held = held;": "skip;",
    },
    "a panic counts as seen before the servo says that it is held": {
        "seen = block[own].panic }": "block[own].panic = 0 }"
    },
    "the gateway does not look whether there is a new block": {
        "raised = (raised == place -> NONE : place);": "raised = NONE;"
    },
    "an arm given before a fault clears it": {":: news -> block[own].arm = 0": ":: news -> skip"},
    "another scene throws the old block away": {
        ":: skip /* another scene: the block stays where it is */": ":: d_step { clear(place); place = NONE; leave() }"
    },
    "a panic in a fault clears it": {
        "#define AFTER_PANIC(s) ((s) == 0 -> 1 : ((s) == 1 -> 1 : (2)))": "#define AFTER_PANIC(s) ((s) == 2 -> 0 : 1)"
    },
}


def searched(text: str, folder: Path) -> str:
    """Findings of the search of all its states."""
    (folder / "model.pml").write_text(text, encoding="utf-8")
    for command in (
        ["spin", "-a", "model.pml"],
        ["gcc", "-O1", "-w", "-DSAFETY", "-DMEMLIM=1000", "-o", "pan", "pan.c"],
    ):
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    run = subprocess.run(["./pan", "-m1000000"], cwd=folder, check=True, capture_output=True, text=True)
    return run.stdout


def test_the_model_is_made_from_the_table() -> None:
    assert MODEL.read_text(encoding="utf-8") == model(), (
        "run: .venv/bin/python tests/model/permission_model.py"
    )


def test_no_state_has_force_after_panic_or_fault_without_an_arm(tmp_path: Path) -> None:
    said = searched(model(), tmp_path)
    assert "errors: 0" in said, said
    assert "Search not completed" not in said, said
    assert "max search depth too small" not in said, said
    # Every step of every process is taken somewhere; none of them ever ends.
    unreached = re.findall(r"state \d+, \"(.*)\"", said)
    assert set(unreached) == {"-end-"}, unreached


@pytest.mark.long
def test_there_is_force_to_be_had(tmp_path: Path) -> None:
    text = model()
    assert text.count(PROPERTY) == 1
    assert "errors: 1" in searched(text.replace(PROPERTY, "assert(!MAY_PUSH(state))"), tmp_path)
    armed = text.replace(PROPERTY, "assert(!(MAY_PUSH(state) && armed))").replace(
        "state = AFTER_ARM(state)", "armed = 1; state = AFTER_ARM(state)"
    )
    assert "errors: 1" in searched(armed.replace("\tbyte state;", "\tbyte state;\n\tbit armed;"), tmp_path)


@pytest.mark.parametrize("what", FORGOTTEN)
@pytest.mark.daily("a panic in a fault clears it")
def test_whatever_is_forgotten_is_found(what: str, tmp_path: Path) -> None:
    text = model()
    for line, instead in FORGOTTEN[what].items():
        assert text.count(line) == 1, line
        text = text.replace(line, instead)
    said = searched(text, tmp_path)
    assert "errors: 1" in said, said
    assert "assertion violated" in said
