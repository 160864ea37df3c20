"""Asking until somebody answers, of a session that loses answers."""

from types import SimpleNamespace
from typing import Any, cast

import zenoh

from web_panel.rig.query import RepeatedQuery


class Session:
    """Each question gets the next of these answers; None is lost on the way."""

    def __init__(self, *answers: str | None) -> None:
        self._answers = list(answers)
        self.asked = 0

    def get(self, key: str, timeout: float) -> Any:
        self.asked += 1
        answer = self._answers.pop(0)
        replies = [SimpleNamespace(ok=answer)] if answer is not None else []
        return Replies(replies)


class Replies:
    def __init__(self, replies: list[Any]) -> None:
        self._replies = replies

    def try_recv(self) -> Any:
        if not self._replies:
            raise zenoh.ZError("every reply is in")
        return self._replies.pop()


def asking(session: Session, read: list[str]) -> RepeatedQuery:
    def take(sample: Any) -> bool:
        read.append(sample)
        return sample != "rubbish"

    return RepeatedQuery(cast(zenoh.Session, session), "k", take)


def follow(one: RepeatedQuery, *times: float) -> None:
    for now in times:
        one.follow(now)


def test_what_got_lost_or_cannot_be_read_is_asked_again_after_a_second() -> None:
    session, read = Session(None, "rubbish", "good"), list[str]()
    one = asking(session, read)
    follow(one, 0.0, 0.1, 0.9)
    assert session.asked == 1
    follow(one, 1.0, 1.1, 2.0, 2.1)
    assert (session.asked, read) == (3, ["rubbish", "good"])
    follow(one, 3.0, 9.0)
    assert session.asked == 3


def test_news_while_a_question_is_under_way_are_asked_for_too() -> None:
    session, read = Session("old", "new", "newer"), list[str]()
    one = asking(session, read)
    one.follow(0.0)
    one.stale = True
    follow(one, 0.1, 1.0, 1.1)
    assert read == ["old", "new"]
    one.ask_at_once()
    follow(one, 1.2, 1.3)
    assert read == ["old", "new", "newer"]
