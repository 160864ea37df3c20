"""Notebooks of docs/notebooks: plain scripts in cells, public names only, and they print what stands in them."""

import ast
import doctest
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import drumstick as ds

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = {path.stem: path for path in sorted((ROOT / "docs" / "notebooks").glob("*.py"))}
NOTEBOOKS = sorted({*SCRIPTS} - {"stranger"})
OURS = {
    "drumstick",
    "drumstick_lab",
    "haptic_server",
    "protocol",
    "realtime",
    "rig",
    "sound_server",
    "web_panel",
}
PROMISED = re.compile(r"^# > (.*)$", re.MULTILINE)
MARKDOWN = re.compile(r'^# %% \[markdown\]\n"""\n(.*?)\n"""$', re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\d+\.\d+|\d{2,}")  # "two strokes" and "(1,1)" are words
EXEMPT = re.compile(r"`[^`]*`|\b(?:19|20)\d\d\b")  # code, and years


def text_of(name: str) -> str:
    return SCRIPTS[name].read_text(encoding="utf-8")


def imported(tree: ast.Module) -> set[str]:
    """Modules of ours that it imports, as it writes them."""
    lines = [ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return {line for line in lines if OURS & {*re.split(r"[ .,]", line)}}


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_uses_public_names_only(name: str) -> None:
    tree = ast.parse(text_of(name))
    assert imported(tree) == {"import drumstick as ds"}
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "ds"
    }
    assert used
    assert used <= {*ds.__all__}


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_begins_with_its_purpose_and_tells_no_number_that_it_does_not_show(name: str) -> None:
    text = text_of(name)
    told = MARKDOWN.findall(text)
    assert text.startswith('# %% [markdown]\n"""\n# ')
    assert "\n\nFor " in told[0]
    assert len(told) == text.count("# %% [markdown]")
    shown = MARKDOWN.sub("", text)
    numbers = {number for part in told for number in NUMBER.findall(EXEMPT.sub("", part))}
    assert {
        number for number in numbers if not re.search(rf"(?<![\d.]){re.escape(number)}(?!\d)", shown)
    } == set()


@pytest.mark.parametrize("name", SCRIPTS)
@pytest.mark.daily("stranger")
def test_a_script_runs_without_a_warning_and_prints_what_stands_in_it(name: str, tmp_path: Path) -> None:
    quiet = ["-W", "error", "-W", "ignore:FigureCanvasAgg is non-interactive:UserWarning"]
    ran = subprocess.run(
        [sys.executable, *quiet, SCRIPTS[name]],
        cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    wanted = "".join(f"{line}\n" for line in PROMISED.findall(text_of(name)))
    printed = ran.stdout if wanted else ""
    assert doctest.OutputChecker().check_output(wanted, printed, doctest.ELLIPSIS), printed


def test_a_strangers_script_is_short() -> None:
    assert len(text_of("stranger").splitlines()) <= 15


def test_the_recorded_levels_are_those_that_were_measured() -> None:
    measured = json.loads((ROOT / "lab/results/beside_recordings.json").read_text(encoding="utf-8"))
    given = {
        node.targets[0].id: ast.literal_eval(node.value)
        for node in ast.parse(text_of("drums")).body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and node.targets[0].id in ("RECORDED", "BESIDE_OTHERS_DB")
    }
    recorded = {name: drum for kind in measured["recordings"].values() for name, drum in kind["work"].items()}
    scenes = measured["scenes"]
    assert given["RECORDED"] == {
        name: recorded[scenes[name]["made_beside"]]["bands_dB"]
        for name in ("mid-tom", "snare", "snare, strainer off")
    }
    assert [*given["BESIDE_OTHERS_DB"].values()] == [
        measured["among_recordings_dB"]["tom"]["Forzee High / Forzee Mid"],
        measured["real_from_held_out_dB"]["tom"]["Forzee Mid"],
        scenes["mid-tom"]["median_held_out_dB"],
        scenes["snare"]["median_held_out_dB"],
    ]


def test_the_page_lists_every_notebook() -> None:
    page = (ROOT / "docs" / "notebooks.md").read_text(encoding="utf-8")
    assert {*re.findall(r"\(notebooks/(\w+)\.py\)", page)} == {*SCRIPTS}
