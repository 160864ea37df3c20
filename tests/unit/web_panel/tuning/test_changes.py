"""Undo, A and B as whole sets, against a haptic server made of a dictionary."""

import dataclasses
import json

import pytest

from changes_bench import HOLDER, OTHER, SCENE, TABLE, Rig
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback
from web_panel.controls.steps_row import sets_words, step_words


def test_changes_are_undone_one_by_one_and_done_again(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.change("k_coll", 6000.0)
    rig.changes.undo(OTHER)
    rig.until(lambda: len(rig.changes.history.back) == 1)
    assert (rig.values["dv_pls"], rig.values["k_coll"]) == (0.3, 5000.0)
    step = rig.changes.history.back[-1]
    assert step_words(step.before, rig.rig_state.standing(), TABLE) == "Δv_pls 0.3 → 0.2 m/s"
    rig.changes.undo(OTHER)
    rig.until(lambda: not rig.changes.history.back)
    assert rig.values["dv_pls"] == 0.2
    rig.changes.undo(OTHER)  # nothing left: nothing is asked
    rig.changes.redo(OTHER)
    rig.until(lambda: rig.changes.history.back)
    assert (rig.values["dv_pls"], rig.values["k_coll"]) == (0.3, 5000.0)
    assert len(rig.asked) == 5


def test_undo_is_worded_from_what_holds_whoever_set_it(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.rig_state.note_readback("dv_pls", Readback(value=0.5, revision=9))  # by OSC, say
    (step,) = rig.changes.history.back
    assert step_words(step.before, rig.rig_state.standing(), TABLE) == "Δv_pls 0.5 → 0.2 m/s"
    rig.rig_state.note_readback("dv_pls", Readback(value=0.2, revision=10))
    assert step_words(step.before, rig.rig_state.standing(), TABLE) == "changes nothing that holds"


def test_an_undo_that_is_refused_stays_to_be_undone_and_says_why(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.refusal = "Ada is tuning"
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.changes.words)
    assert (rig.changes.words, rig.changes.alarm) == ("Refused: Ada is tuning", True)
    assert len(rig.changes.history.back) == 1
    rig.refusal = ""
    rig.changes.undo(OTHER)
    rig.until(lambda: not rig.changes.history.back)
    assert rig.changes.words == ""


def test_refusal_of_a_roll_is_forgotten_with_its_scene(rig: Rig) -> None:
    rig.refusal = "90 Hz cannot be met"
    rig.changes.want_roll("rate", 90.0, OTHER)
    rig.until(lambda: rig.changes.roll_words)
    rig.rig_state.note_scene(dataclasses.replace(SCENE, name="other"), TABLE)
    rig.changes.take_answers(rig.rig_state, rig.now)
    assert rig.changes.roll_words == ""


def test_a_and_b_are_switched_as_one_set_and_undone_as_one(rig: Rig) -> None:
    def told() -> str:
        return sets_words(rig.changes, rig.rig_state.standing(), TABLE)

    assert told().startswith("A and B are empty")
    rig.changes.switch("A", OTHER)  # empty: nothing is asked
    rig.store("A")
    assert told() == "A is on, as it was stored. B is empty."
    rig.change("dv_pls", 0.3)
    assert told() == "A is on, changed since: Δv_pls. B is empty."
    rig.change("k_coll", 6000.0)
    rig.store("B")
    assert told() == "B is on, as it was stored. A and B differ in Δv_pls, K_coll."
    rig.changes.switch_over(OTHER)
    rig.until(lambda: rig.changes.compare.on == "A")
    assert rig.asked[-1].values == {"dv_pls": 0.2, "k_coll": 5000.0, "z_ss": -0.02}
    assert told().startswith("A is on, as it was stored.")
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.values["k_coll"] == 6000.0)
    assert rig.values["dv_pls"] == 0.3


def test_a_loaded_preset_is_a_step(rig: Rig) -> None:
    assert rig.changes.load("loud", HOLDER).taken
    assert rig.asked[-1].lease == "secret"
    rig.until(lambda: rig.changes.history.back)
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.values["dv_pls"] == 0.2)


def test_only_the_holders_wishes_carry_the_lease(rig: Rig) -> None:
    for client, value in ((HOLDER, 0.3), (OTHER, 0.4), (None, 0.5)):
        rig.changes.want_one("dv_pls", value, client)
        rig.until(lambda value=value: rig.rig_state.readbacks["dv_pls"].value == value)
    assert [request.lease for request in rig.asked] == ["secret", "", ""]


def test_what_is_foreseen_is_the_whole_set_with_the_one_value(rig: Rig) -> None:
    rig.changes.want_one("dv_pls", 0.3, OTHER)
    rig.changes.want_one("z_h0", 0.1, OTHER)
    assert rig.foreseen[0] == {"dv_pls": 0.3, "k_coll": 5000.0, "z_ss": -0.02}
    assert rig.foreseen[1] == {"dv_pls": 0.2, "k_coll": 5000.0, "z_h0": 0.1}


def test_another_scene_forgets_all_of_it(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.store("A")
    paper = parse(shipped_text("paper-roll"), "paper-roll.toml")
    rig.rig_state.note_scene(paper, table_of(paper))
    rig.changes.take_answers(rig.rig_state, rig.now)
    assert not rig.changes.history.back
    assert not rig.changes.compare.slots


def test_undo_redo_a_and_b_outlive_the_panel(rig: Rig) -> None:
    rig.store("A")
    for value in (0.3, 0.4):
        rig.change("dv_pls", value)
    rig.store("B")
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.changes.history.forth)
    rig.restart_panel()
    assert [step.before for step in rig.changes.history.back] == [{"dv_pls": 0.2}]
    assert sets_words(rig.changes, rig.rig_state.standing(), TABLE).endswith("A and B differ in Δv_pls.")
    rig.changes.redo(OTHER)
    rig.until(lambda: rig.values["dv_pls"] == 0.4)
    rig.changes.switch("A", OTHER)
    rig.until(lambda: rig.values["dv_pls"] == 0.2)
    for _ in range(3):
        steps = len(rig.changes.history.back)
        rig.changes.undo(OTHER)
        rig.until(lambda before=steps: len(rig.changes.history.back) < before)
    assert rig.values["dv_pls"] == 0.2
    assert not rig.changes.history.back


def test_another_scene_begins_without_the_steps_of_this_one(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.store("A")
    rig.restart_panel()
    assert rig.changes.history.back
    rig.rig_state.note_scene(dataclasses.replace(SCENE, name="another"), TABLE)
    rig.changes.take_answers(rig.rig_state, rig.now)
    assert not rig.changes.history.back
    assert not rig.changes.compare.slots


@pytest.mark.parametrize(
    "content",
    [
        "", "[", "[1]", "3", '{"scene": MARK}', '{"scene": MARK, "back": 1, "forth": [], "slots": {}, "on": ""}',
        '{"scene": MARK, "back": [[{"dv_pls": NaN}, {"dv_pls": 1}]], "forth": [], "slots": {}, "on": ""}',
        '{"scene": MARK, "back": [[{"dv_pls": 1}, {"k_coll": 1}]], "forth": [], "slots": {}, "on": ""}',
        '{"scene": MARK, "back": [[1, 2, 3]], "forth": [], "slots": {}, "on": ""}',
        '{"scene": MARK, "back": [], "forth": [], "slots": {"A": {"dv_pls": true}}, "on": "A"}',
        '{"scene": MARK, "back": [[{"dv_pls": %s}, {"dv_pls": 1}]], "forth": [], "slots": {}, "on": ""}' % ("9" * 4000),
        "[" * 100_000,
    ],
)  # fmt: skip
def test_a_file_that_is_not_as_the_panel_wrote_it_is_as_none(
    rig: Rig, content: str, caplog: pytest.LogCaptureFixture
) -> None:
    rig.store("A")
    rig.restart_panel()
    mark = json.loads(rig.path.read_text())["scene"]
    rig.path.write_text(content.replace("MARK", json.dumps(mark)))
    rig.changes.close()
    rig.start_panel()
    assert not rig.changes.compare.slots
    assert not rig.changes.history.back
    assert f"{rig.path} is not used" in caplog.text
    rig.change("dv_pls", 0.3)  # and it goes on
    assert len(rig.changes.history.back) == 1


def test_a_folder_that_takes_no_file_stops_nothing(rig: Rig, caplog: pytest.LogCaptureFixture) -> None:
    (rig.path.parent / f".{rig.path.name}").mkdir()
    rig.change("dv_pls", 0.3)
    rig.changes.take_answers(rig.rig_state, rig.now + 5.0)
    assert "cannot be written" in caplog.text
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.values["dv_pls"] == 0.2)
