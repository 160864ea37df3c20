"""Questions of the views: asked once, and again where the process that computes ended."""

from typing import Any, cast

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from web_panel.computing.computer import Computed, Computer
from web_panel.computing.computing_messages import Question, Ticks, Trouble
from web_panel.computing.computing_messages import Theory as TheoryMessage
from web_panel.rig.rig_state import RigState
from web_panel.views.theory_client import TheoryClient

ENDED, REFUSED = Trouble("it ended", passes=True), Trouble("the motion never repeats")
THEORY = TheoryMessage(([1.0], [2.0]), ([], []), ([], []), ([], []), "one end")


class Desk:
    """A computer that answers when it is told to."""

    def __init__(self) -> None:
        self.asked: list[Question] = []
        self.newest: Computed | None = None
        self.busy = False

    def ask(self, question: Question) -> None:
        self.asked.append(question)
        self.busy = True

    def answer(self, answer: Any) -> None:
        self.newest, self.busy = Computed(self.asked[-1], answer), False


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.fixture
def client(desk: Desk) -> TheoryClient:
    return TheoryClient(cast("Computer", desk))


@pytest.fixture
def rig_state() -> RigState:
    return RigState(scene=parse(shipped_text("roll"), "roll.toml"))


def test_theory_that_got_lost_is_asked_for_again(
    client: TheoryClient, desk: Desk, rig_state: RigState
) -> None:
    assert client.theory(rig_state) is None
    desk.answer(ENDED)
    found = client.theory(rig_state)
    assert found is not None
    assert found.missing == "No prediction here: it ended"
    assert len(desk.asked) == 2
    assert client.theory(rig_state) == found, "what is known is told while the process is busy"
    assert len(desk.asked) == 2
    desk.answer(THEORY)
    found = client.theory(rig_state)
    assert found is not None
    assert (found.missing, found.ends) == ("", "one end")
    assert len(desk.asked) == 2


def test_ticks_that_got_lost_are_asked_for_again(
    client: TheoryClient, desk: Desk, rig_state: RigState
) -> None:
    assert client.ticks(rig_state) is None
    desk.answer(ENDED)
    assert client.ticks(rig_state) == ENDED
    assert len(desk.asked) == 2
    desk.answer(Ticks({"all": 1.0}, 20_000.0))
    assert client.ticks(rig_state) == Ticks({"all": 1.0}, 20_000.0)
    assert len(desk.asked) == 2


def test_a_refusal_is_kept(client: TheoryClient, desk: Desk, rig_state: RigState) -> None:
    client.theory(rig_state)
    desk.answer(REFUSED)
    client.theory(rig_state)
    client.theory(rig_state)
    assert len(desk.asked) == 1
    client.ticks(rig_state)
    desk.answer(REFUSED)
    assert client.ticks(rig_state) == client.ticks(rig_state) == REFUSED
    assert len(desk.asked) == 2
