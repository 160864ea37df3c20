"""`drumstick accuracy`: what it stores, draws and says, of the shipped result; and a part of it run for real."""

import copy
import json
import re
import tomllib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from typer.testing import CliRunner

from drumstick.drum.membrane.pitch_error import TWENTIETH
from drumstick.perception.jnd import pitch_jnd_cents, sharpest_Hz
from drumstick.scenes.scene_text import parse
from drumstick_lab.accuracy import choices as choices_module
from drumstick_lab.accuracy import command, store
from drumstick_lab.accuracy.choices import choices
from drumstick_lab.accuracy.figures import FIGURES, pitch, whole, write
from drumstick_lab.accuracy.peers import windows
from drumstick_lab.accuracy.run import PARTS, begun, fill
from drumstick_lab.benchmarks import worse
from realtime.kernels.store import hash_of_all
from rig import accuracy_files, folder
from rig.cli.command import app
from rig.figures.style import styled


@pytest.fixture(scope="module")
def shipped() -> dict[str, Any]:
    return store.shipped()


def test_the_shipped_result_is_a_full_one(shipped: dict[str, Any]) -> None:
    assert list(shipped) == ["machine", *PARTS]
    assert shipped["machine"]["quick"] is False
    json.dumps(shipped, allow_nan=False)


def test_the_instrument_carries_the_summary_of_this_result(shipped: dict[str, Any]) -> None:
    assert accuracy_files.SHIPPED.read_text(encoding="utf-8") == store.summary(shipped), (
        "run: .venv/bin/drumstick lab accuracy-page"
    )


@pytest.mark.long
def test_every_part_has_its_figures_and_its_choices(shipped: dict[str, Any], tmp_path: Path) -> None:
    written = write(shipped, tmp_path)
    assert written == [f"{name}.png" for name, _, _ in FIGURES]
    assert all((tmp_path / name).stat().st_size > 10_000 for name in written)
    for part in set(PARTS) - {"whole"}:  # which has a table of its own
        alone = choices({"machine": shipped["machine"], part: shipped[part]})
        assert alone
        assert all(
            words and "None" not in words and "nan" not in words for choice in alone for words in choice
        )


@styled
def _below_labels(figure: Figure) -> tuple[list[Bbox], npt.NDArray[np.uint8]]:
    """Boxes of the labels, and the picture without them, from its lowest row up."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts = figure.axes[0].texts
    boxes = [text.get_window_extent() for text in texts if text.get_text()]  # others lead to a mark
    for text in texts:
        text.set_visible(False)
    canvas.draw()
    return boxes, np.asarray(canvas.buffer_rgba())[::-1, :, :3]


@pytest.mark.parametrize(("draw", "part"), [(pitch, "mesh"), (whole, "whole")])
def test_a_label_covers_no_mark_no_line_and_no_other_label(
    shipped: dict[str, Any], draw: Callable[[dict[str, Any]], Figure], part: str
) -> None:
    boxes, picture = _below_labels(draw(shipped[part]))
    assert len(boxes) >= 6
    for box in boxes:
        left, low, right, high = map(int, box.extents)
        assert picture[low:high, left:right].min() > 200, box  # white, and the faint lines of the grid
        assert box.count_overlaps(boxes) == 1  # itself


def test_the_lowest_mode_is_as_true_as_the_decision_says(shipped: dict[str, Any]) -> None:
    """docs/decisions/0011: by the scheme, and in float32 up to 100 and 200 junctions across."""
    rows = [row for row in shipped["mesh"]["rows"] if row["rim"] == "weights"]
    for row in rows:
        most = 0.01 if row["precision"] == "float64" else 0.05 if row["across"] < 101.0 else 0.3
        assert abs(row["f01_cents"]) <= most


def _costs(words: str) -> float:
    found = re.match(r"([+-]?[\d.]+)", words)
    assert found
    return float(found[1])


def test_a_choice_holds_of_the_worst_mode_and_nothing_cheaper_does(shipped: dict[str, Any]) -> None:
    told = {choice.want: choice for choice in choices(shipped)}
    rows = [row for row in shipped["mesh"]["rows"] if row["scheme"] and row["precision"] == "float32"]
    a_jnd = pitch_jnd_cents(sharpest_Hz(150.0, 150.0 * TWENTIETH))
    for cents, want in (
        (a_jnd, f"the lowest twenty modes in tune within a just noticeable difference: {a_jnd:.1f} cents"),
        (
            0.5 * a_jnd,
            f"the lowest twenty modes in tune within half a just noticeable difference: {0.5 * a_jnd:.1f} cents",
        ),
    ):
        good = [row for row in rows if row["worst_cents"] + abs(row["f01_cents"]) <= cents]
        cheapest_ns = min(row["ns_per_sample"] for row in good if row["rim"] == "weights")
        assert _costs(told[want].costs) == float(f"{1e-7 * cheapest_ns * 48_000:.2g}")


def test_nothing_below_a_twentieth_of_what_can_be_told_is_recommended(shipped: dict[str, Any]) -> None:
    """A time step to a millionth was, at sixteen times the cost of the exact motion."""
    assert [choice.choose for choice in choices({"stick": shipped["stick"]})] == ["nothing: it is exact"]
    typed = [choice.choose for choice in choices({"mesh": shipped["mesh"]}) if "noticeable" in choice.want]
    rows = {
        choices_module.mesh_words(row): row
        for row in shipped["mesh"]["rows"]
        if row["scheme"] and (row["precision"], row["rim"]) == ("float32", "weights")
    }
    a_jnd = pitch_jnd_cents(sharpest_Hz(150.0, 150.0 * TWENTIETH))
    assert len(typed) == 2
    assert all(choices_module.worst_cents(rows[words]) > 0.05 * a_jnd for words in typed)


def test_a_choice_holds_of_the_worst_phase_and_is_let(shipped: dict[str, Any]) -> None:
    close, little = (choice for choice in choices({"servo": shipped["servo"]}))
    for choice, is_good in (
        (
            close,
            lambda row: all(
                abs(row["restitution"][key] - row["design"]) <= 0.02 for key in ("least", "most")
            ),
        ),
        (little, lambda row: row["restitution"]["most"] ** 2 - row["design"] ** 2 <= 0.01),
    ):
        scene = tomllib.loads("\n".join(re.findall(r"`([^`]+)`", choice.choose)))
        rows = [
            row for row in shipped["servo"]["rows"]
            if row["filter"] == shipped["servo"]["rows"][0]["filter"]
            and (row["k_coll"], row["rate_Hz"], row["predictor"])
            == (scene["stick"]["k_coll_N_per_m"], scene["servo"]["rate_Hz"], scene["servo"]["predictor"])
        ]  # fmt: skip
        assert any(is_good(row) and row["passes_envelope"] for row in rows)


def test_what_is_to_be_typed_is_a_scene(shipped: dict[str, Any]) -> None:
    for choice in choices({part: shipped[part] for part in ("servo", "mesh", "excitation", "effects")}):
        typed = re.findall(r"`([^`]+)`", choice.choose)
        assert typed or choice.choose == "no table of effects"
        parse("\n".join(typed), "typed")


def test_a_snares_cost_is_with_the_head_that_it_needs(shipped: dict[str, Any]) -> None:
    (snare,) = (choice for choice in choices({"effects": shipped["effects"]}) if "`snare`" in choice.want)
    added_ns = {row["effect"]: row["added_ns"] for row in shipped["effects"]["sample"]}
    assert _costs(snare.costs) == float(f"{1e-7 * (added_ns['cavity'] + added_ns['snare']) * 48_000:.2g}")
    assert "[drum.effects.cavity]" in snare.choose


def test_what_cannot_be_told_from_nothing_has_no_figure(shipped: dict[str, Any]) -> None:
    told = {choice.want: choice.costs for choice in choices({"effects": shipped["effects"]})}
    small = [row["effect"] for row in shipped["effects"]["sample"] if row["added_ns"] < 20.0]
    for name in {"uniform_loss", "rim"} & set(small):
        assert told[f"`{name}`"].startswith("too little to be told from nothing; ")
    assert "rim" in small


def test_a_measured_latency_goes_before_a_reckoned_one(shipped: dict[str, Any]) -> None:
    latency = {"block": 32, "rows": {"at_once": {"sound_ms": {"p50": 7.7}}}}
    streams = {"block": 32, "rows": [{"rate_Hz": 4000.0, "sound_ms": {"p50": 6.6}}]}
    part = {"excitation": shipped["excitation"], "whole": {"streams": streams}}
    message, stream = choices(part, latency)
    assert message.costs.startswith("7.7 ms, measured in blocks of 32 samples; ")
    assert stream.costs.startswith("6.6 ms, computed for blocks of 32 samples; ")  # none played at that rate
    message, stream = choices({"excitation": shipped["excitation"]})
    assert "reckoned for blocks of 128 samples" in message.costs
    assert "reckoned for blocks of 128 samples" in stream.costs


@pytest.mark.long
def test_a_part_run_for_real_is_json(monkeypatch: pytest.MonkeyPatch) -> None:
    found = begun(True, ("servo",))
    fill(found)
    assert found["machine"]["quick"] is True
    assert found["machine"]["seconds"] > 0.0
    assert len(found["servo"]["rows"]) > 5
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize("as_json", [False, True])
@pytest.mark.long
def test_the_command_keeps_the_result_where_the_panel_looks(
    shipped: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, as_json: bool
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(command, "begun", lambda quick: {**shipped, "asked": quick})
    monkeypatch.setattr(command, "fill", lambda found: None)
    told = CliRunner().invoke(app, ["accuracy", "--quick", *(["--json"] if as_json else [])])
    assert told.exit_code == 0
    kept = json.loads((folder.accuracy_folder() / store.FILE).read_text())
    assert kept["asked"] is True
    assert folder.accuracy_folder().is_relative_to(tmp_path)
    if as_json:
        assert json.loads(told.stdout) == kept
    else:
        assert "[drum.effects.cavity]" in told.stdout.replace("\n", "")
        assert "accuracy-pitch.png" in told.stdout.replace("\n", "")


def test_what_was_measured_before_a_failure_is_kept_beside_the_last_whole_result(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fails(found: dict[str, Any]) -> None:
        found["stick"] = {"rows": [1, 2]}
        raise ChildProcessError("the peer ended")

    monkeypatch.setattr(command, "fill", fails)
    (tmp_path / store.FILE).write_text("whole")
    told = CliRunner().invoke(app, ["accuracy", "--out", str(tmp_path)])
    assert told.exit_code != 0
    assert json.loads((tmp_path / store.UNFINISHED).read_text())["stick"] == {"rows": [1, 2]}
    assert (tmp_path / store.FILE).read_text() == "whole"


def test_a_quick_run_leaves_a_full_one_alone_and_a_whole_one_clears_what_was_not_finished(
    shipped: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def begun(quick: bool) -> dict[str, Any]:
        return {**shipped, "machine": {**shipped["machine"], "quick": quick}}

    monkeypatch.setattr(command, "begun", begun)
    monkeypatch.setattr(command, "fill", lambda found: None)
    monkeypatch.setattr("drumstick_lab.accuracy.figures.write", lambda found, out: [])
    (tmp_path / store.UNFINISHED).write_text("{}")
    for asked, where in ((["--quick"], ""), ([], ""), (["--quick"], "quick")):
        told = CliRunner().invoke(app, ["accuracy", *asked, "--out", str(tmp_path)])
        assert told.exit_code == 0
        assert json.loads((tmp_path / where / store.FILE).read_text())["machine"]["quick"] is bool(asked)
        assert not (tmp_path / store.UNFINISHED).exists()
    assert store.is_full(tmp_path)


def test_a_result_says_what_made_it() -> None:
    machine = begun(True, ())["machine"]
    assert machine["packages"]["haptic-drumstick"] == version("haptic-drumstick")
    assert {"scipy", "matplotlib"} <= machine["packages"].keys()
    assert machine["kernels"] == hash_of_all()
    assert machine["peers"] == windows.versions()


def test_a_machine_without_debians_tool_has_no_versions_of_its_packages(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert windows.versions() == {}


def test_a_folder_that_cannot_be_is_said_before_the_work(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(command, "fill", lambda found: pytest.fail("minutes, for nothing"))
    (tmp_path / "file").touch()
    told = CliRunner().invoke(app, ["accuracy", "--out", str(tmp_path / "file")])
    assert told.exit_code != 0


def test_what_got_worse_is_found_and_only_that(shipped: dict[str, Any]) -> None:
    assert worse.changes(shipped, shipped, 1.3) == ([], [])
    slower = copy.deepcopy(shipped)
    row = slower["mesh"]["rows"][3]
    row["ratio"] *= 1.5
    slower["stick"]["rows"][1]["error_contacts"] *= 1.5
    slower["effects"]["sample"][0]["ratio"] /= 1.5
    got_worse, got_better = worse.changes(slower, shipped, 1.3)
    assert [(change.key, change.what.split()[0]) for change in got_worse] == [
        ("error_contacts", "stick"),
        ("cost over the yardstick", "mesh"),
    ]
    assert [change.what.split()[0] for change in got_better] == ["effects"]
    assert worse.changes(slower, shipped, 1.6)[0] == got_worse[:1]


def _set(found: dict[str, Any], *path: Any, value: Any) -> None:
    for key in path[:-1]:
        found = found[key]
    found[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value", "key"),
    [
        (("mesh", "rows", 0, "bandwidth_Hz"), 100.0, "bandwidth_Hz"),
        (("mesh", "rows", 0, "modes_found"), 19, "modes_found"),
        (("servo", "rows", 0, "restitution", "most"), 3.0, "restitution_most"),
        (("servo", "rows", 0, "restitution", "least"), 0.1, "restitution_least"),
        (("servo", "rows", 0, "guarded_most"), 3.0, "guarded_most"),
        (("servo", "rows", 0, "passes_envelope"), False, "passes_envelope"),
        (("effects", "none", "over_by_hand"), 1.06, "cost over the yardstick"),
    ],
)
def test_whatever_got_worse_is_found_and_its_mending_too(
    shipped: dict[str, Any], path: tuple[Any, ...], value: float, key: str
) -> None:
    changed = copy.deepcopy(shipped)
    _set(changed, *path, value=value)
    assert [change.key for change in worse.changes(changed, shipped, 1.3)[0]] == [key]
    assert worse.changes(changed, shipped, 1.3)[1] == []
    assert [change.key for change in worse.changes(shipped, changed, 1.3)[1]] == [key]


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.daily("True")
def test_rows_that_are_gone_are_a_fault_between_two_runs_alike(
    shipped: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, quick: bool
) -> None:
    """A quick run has fewer by design."""
    fewer = copy.deepcopy(shipped)
    fewer["machine"]["quick"] = quick
    del fewer["stick"]["rows"][5]
    (tmp_path / "new.json").write_text(json.dumps(fewer))
    monkeypatch.setattr("sys.argv", ["worse.py", str(tmp_path / "new.json")])
    assert worse.main() == (0 if quick else 1)
