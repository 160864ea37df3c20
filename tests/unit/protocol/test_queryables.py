"""Queries by wildcard: whoever looks around is answered where that changes nothing, and only there."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh

from ports import free_port
from protocol.messages import RefusalReply, decode
from protocol.queryables import Queryables
from protocol.session import open_router

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def session() -> Iterator[zenoh.Session]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with open_router(endpoint) as opened:
        yield opened


@pytest.mark.parametrize(
    ("declared", "asked", "is_heard"),
    [
        ("w/save", "w/save", True),
        ("w/set/*", "w/set/dv_pls", True),
        ("w/set/*", "w/set/*", False),
        ("w/set/*", "w/set/d$*", False),
        ("w/save", "w/*", False),
        ("w/save", "w/save/**", False),
        ("w/save", "w/s$*", False),
        ("w/save", "*/save", False),
        ("w/save", "**", False),
    ],
)
def test_a_writing_key_hears_only_who_names_it(
    session: zenoh.Session, declared: str, asked: str, is_heard: bool
) -> None:
    heard: list[str] = []

    def receive(query: zenoh.Query) -> None:
        heard.append(str(query.key_expr))
        query.reply(query.key_expr, b"done")
        query.drop()

    queryables = Queryables(session)
    queryables.declare_writing(declared, receive)
    (reply,) = session.get(asked, timeout=5.0)
    queryables.undeclare()
    assert heard == ([asked] if is_heard else [])
    assert queryables.refused == (0 if is_heard else 1)
    if not is_heard:
        assert reply.err is not None
        words = decode(reply.err.payload.to_bytes(), RefusalReply).reason
        assert words == f"{declared} changes something: name one key; wildcards are for reading only"


def test_a_reading_key_hears_wildcards_too(session: zenoh.Session) -> None:
    queryables = Queryables(session)
    queryables.declare_reading("w/param/*", lambda query: (query.reply("w/param/m", b"1"), query.drop()))
    for asked in ("w/param/m", "w/param/*", "w/**"):
        assert [reply.ok is not None for reply in session.get(asked, timeout=5.0)] == [True]
    assert (queryables.reading, queryables.writing) == (["w/param/*"], [])
    queryables.undeclare()
    assert list(session.get("w/param/m", timeout=5.0)) == []


def test_nothing_else_answers_queries() -> None:
    """Whoever declares a queryable past the rule would have to keep it by hand."""
    call = re.compile(r"\.declare_queryable\(")
    found = [
        str(path.relative_to(ROOT))
        for folder in ("services", "shared")
        for path in (ROOT / folder).rglob("*.py")
        if call.search(path.read_text(encoding="utf-8"))
    ]
    assert found == ["shared/protocol/queryables.py"]
