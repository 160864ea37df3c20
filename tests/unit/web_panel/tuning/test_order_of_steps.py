"""Order of undo, redo, A and B: each waits for what stood before it, and for nothing else."""

import threading

from changes_bench import HOLDER, OTHER, Rig
from protocol.messages import Readback
from web_panel.rig.answer import Answer
from web_panel.rig.set_request import ROLL, SetRequest


def test_values_are_set_while_a_roll_is_sought(rig: Rig) -> None:
    found, set_at_once = threading.Event(), rig.set

    def set_(request: SetRequest) -> Answer:
        if request.purpose == ROLL:
            assert found.wait(60.0)
        return set_at_once(request)

    rig.changes.close()
    rig.set = set_
    rig.start_panel()
    rig.changes.want_roll("rate", 30.0, OTHER)
    rig.change("dv_pls", 0.3)
    found.set()
    rig.until(lambda: "rate" in rig.values)


def test_an_undo_follows_what_was_asked_before_it_though_it_is_not_answered_yet(rig: Rig) -> None:
    answered, set_at_once = threading.Event(), rig.set

    def set_(request: SetRequest) -> Answer:
        answer = set_at_once(request)
        assert answered.wait(60.0)
        return answer

    rig.changes.close()
    rig.set = set_
    rig.start_panel()
    rig.changes.want_one("dv_pls", 0.3, OTHER)
    rig.changes.undo(OTHER)
    rig.changes.store("A")
    for _ in range(5):
        rig.changes.take_answers(rig.rig_state, rig.now)
    assert not rig.changes.compare.slots
    answered.set()
    rig.until(lambda: rig.changes.compare.slots)
    assert [request.values for request in rig.asked] == [{"dv_pls": 0.3}, {"dv_pls": 0.2}]
    assert rig.changes.compare.slots["A"]["dv_pls"] == 0.2


class Roll:
    """A roll that is sought until it is found, while sets are answered at once; how long it has been asked for."""

    def __init__(self, rig: Rig) -> None:
        self.found, self._set_at_once = threading.Event(), rig.set
        rig.changes.close()
        rig.set = self._set
        rig.start_panel()

    def _set(self, request: SetRequest) -> Answer:
        if request.purpose == ROLL:
            assert self.found.wait(60.0)
        return self._set_at_once(request)


def test_an_undo_does_not_wait_for_a_roll_that_was_asked_for_after_it(rig: Rig) -> None:
    roll = Roll(rig)
    rig.change("dv_pls", 0.3)
    rig.changes.undo(OTHER)
    rig.changes.store("A")
    rig.changes.want_roll("rate", 30.0, OTHER)
    rig.until(lambda: rig.changes.compare.slots)
    assert rig.values["dv_pls"] == rig.changes.compare.slots["A"]["dv_pls"] == 0.2
    roll.found.set()
    rig.until(lambda: "rate" in rig.values)


def test_an_undo_waits_for_a_roll_that_was_asked_for_before_it(rig: Rig) -> None:
    roll = Roll(rig)
    rig.rig_state.note_readback("rate", Readback(value=20.0, revision=0))
    rig.change("dv_pls", 0.3)
    rig.changes.want_roll("rate", 30.0, OTHER)
    rig.changes.undo(OTHER)
    for _ in range(5):
        rig.changes.take_answers(rig.rig_state, rig.now)
    assert rig.values["dv_pls"] == 0.3
    roll.found.set()
    rig.until(lambda: rig.changes.history.forth)
    assert (rig.values["rate"], rig.values["dv_pls"]) == (20.0, 0.3)


def test_an_undo_goes_through_while_another_browser_drags(rig: Rig) -> None:
    """Its next position is asked for before the last one is answered, so something is always asked."""
    set_at_once, answers, ended = rig.set, threading.Semaphore(0), threading.Event()

    def set_(request: SetRequest) -> Answer:
        if "k_coll" in request.values and not ended.is_set():
            rig.changes.want_one("k_coll", request.values["k_coll"] + 1.0, HOLDER)
            assert answers.acquire(timeout=60.0)
        return set_at_once(request)

    def is_undone() -> bool:
        answers.release()  # one of the drag's a round
        return rig.values["dv_pls"] == 0.2 and all(
            "dv_pls" not in step.after for step in rig.changes.history.back
        )

    rig.changes.close()
    rig.set = set_
    rig.start_panel()
    rig.change("dv_pls", 0.3)
    rig.changes.undo(OTHER)
    rig.changes.want_one("k_coll", 5000.0, HOLDER)
    rig.until(is_undone)
    ended.set()
    answers.release()


def test_what_was_redone_can_be_undone_though_another_browser_changed_something_meanwhile(rig: Rig) -> None:
    pressed, set_at_once = threading.Event(), rig.set

    def set_(request: SetRequest) -> Answer:
        if "k_coll" in request.values:
            assert pressed.wait(60.0)
        return set_at_once(request)

    rig.changes.close()
    rig.set = set_
    rig.start_panel()
    rig.change("dv_pls", 0.3)
    rig.changes.undo(OTHER)
    rig.until(lambda: rig.changes.history.forth)
    rig.changes.redo(OTHER)
    rig.changes.want_one("k_coll", 6000.0, HOLDER)
    rig.changes.take_answers(rig.rig_state, rig.now)  # the redo stands behind it now
    pressed.set()
    rig.until(lambda: len(rig.changes.history.back) == 2)
    for _ in range(2):
        rig.changes.undo(OTHER)
    rig.until(lambda: not rig.changes.history.back)
    assert (rig.values["dv_pls"], rig.values["k_coll"]) == (0.2, 5000.0)


def test_two_quick_undos_are_two(rig: Rig) -> None:
    rig.change("dv_pls", 0.3)
    rig.change("k_coll", 6000.0)
    rig.changes.undo(OTHER)
    rig.changes.undo(OTHER)
    rig.until(lambda: not rig.changes.history.back)
    assert (rig.values["dv_pls"], rig.values["k_coll"]) == (0.2, 5000.0)
