"""A router that stands for the gateway, behind the rules of the roles, and clients of each role at its TLS door.

It answers on every key, hears every key and notes both.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
import zenoh
from rig_process import free_port

from made_keys import Keyring
from protocol import session as sessions
from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC, ROLES, Role
from protocol.access.rules import access_control
from protocol.session import Public, open_access, open_client, open_router

RIG = "r"
TAILS = (
    "strike", "choke", "release", "contact", "state", "meter", "membrane", "spectrum", "cost", "pointer", "scene",
    "scene/load", "clock", "doctor", "door", "panic", "set", "set/m", "param/m", "preset", "preset/load",
    "preset/save", "lease", "play/strike", "play/choke", "anything",
)  # fmt: skip
TOKENS = tuple(f"alive/{each}/1" for each in ("haptic", "sound", "panel", "record", "pointer", "listener"))
EVERY_RIG = ("drumstick/*/alive/haptic/*", "drumstick/$*r$*/alive/haptic/*", "drumstick/*/alive/*/*")
NOBODY = Role("a certificate of the authority that is of no role")
EVERYBODY = {**ROLES, HAPTIC: NOBODY, "stranger": NOBODY}
SETTLED = "settled"  # a key of no rig: answered, and not noted; no role may ask it
ANSWER_S = 30.0  # the most that a query or a connection waits; it ends as soon as all have answered
EVERY_MESSAGE = [
    "put", "delete", "declare_subscriber", "query", "reply", "declare_queryable", "liveliness_token",
    "liveliness_query", "declare_liveliness_subscriber",
]  # fmt: skip


def key(tail: str, rig: str = RIG) -> str:
    return f"drumstick/{rig}/{tail}"


def seen_by(session: zenoh.Session) -> set[str]:
    """The liveliness tokens that a session finds."""
    replies = list(session.liveliness().get("drumstick/**", timeout=ANSWER_S))
    return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}


def at_once(note: Callable[[zenoh.Sample], None]) -> Any:
    """`note`, called by the thread that receives: what was sent before a reply has then been noted before that reply.

    Without it Zenoh hands each subscriber's samples to a thread of its own, which may come to them at any later time.
    """
    return zenoh.handlers.Callback(note, indirect=False)


def of(tails: tuple[str, ...], *concrete: str) -> set[str]:
    """The concrete names that a row's patterns stand for."""
    patterns = [zenoh.KeyExpr(tail) for tail in tails]
    return {name for name in concrete if any(p.includes(zenoh.KeyExpr(name)) for p in patterns)}


@dataclass
class Gateway:
    """A router with a door for others beside it that hears and answers everything, and notes it."""

    session: zenoh.Session
    door: zenoh.Session
    local: str
    public: str
    put: list[tuple[str, bytes, str]] = field(default_factory=list)  # tail, payload, put or delete
    asked: list[str] = field(default_factory=list)

    def begin(self) -> None:
        self.session.declare_subscriber(
            "drumstick/**",
            at_once(
                lambda sample: self.put.append(
                    (
                        str(sample.key_expr),
                        sample.payload.to_bytes(),
                        "put" if sample.kind == zenoh.SampleKind.PUT else "delete",
                    )
                )
            ),
        )
        for rig in (RIG, "other"):
            for tail in TAILS:
                self._answer(key(tail, rig))
        self.session.declare_queryable(SETTLED, lambda query: query.reply(SETTLED, b"gateway"))

    def _answer(self, own: str) -> None:
        def answer(query: zenoh.Query) -> None:
            self.asked.append(own)
            query.reply(own, b"gateway")
            query.drop()

        self.session.declare_queryable(own, answer)

    def settle(self, session: zenoh.Session, name: str = "local") -> None:
        """Until what `session` sent before has been dealt with, and what was sent to it has come.

        A link keeps the order of one priority, so the answer to a question is behind all of that. To who may ask
        nothing the door itself answers, with an empty end: its own way to the router is then settled on both sides.
        """
        asked = SETTLED
        if name in EVERYBODY:
            asks = of(EVERYBODY[name].asks, *TAILS)
            if not asks:
                self.settle(self.door)
                assert (
                    list(session.get(SETTLED, timeout=ANSWER_S)) == []
                )  # after ANSWER_S it would be an error
                self.settle(self.door)
                return
            asked = key(min(asks))
        # A door that has just opened does not know yet who answers.
        end = time.monotonic() + 60.0
        answers: list[bytes] = []
        while b"gateway" not in answers and time.monotonic() < end:
            replies = list(session.get(asked, payload=b"1", target=zenoh.QueryTarget.ALL, timeout=5.0))
            answers = [reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None]
        assert b"gateway" in answers


@contextmanager
def gateway_of(
    keyring: Keyring, roles: tuple[str, ...] = tuple(ROLES), rules: Any = access_control
) -> Iterator[Gateway]:
    local, public = f"tcp/127.0.0.1:{free_port()}", f"tls/127.0.0.1:{free_port()}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sessions, "access_control", rules)
        admitted = Public(public, keyring.listener(), (RIG,), roles)
        with open_router(local) as session, open_access(local, admitted) as door:
            gateway = Gateway(session, door, local, public)
            gateway.begin()
            yield gateway


def unguarded(direction: str) -> Any:
    """Rules that let everything pass in one direction, so that only the other one refuses."""

    def rules(rigs: Any, roles: Any) -> dict[str, object]:
        acl: Any = access_control(rigs, roles)
        acl["rules"].append(
            {"id": "open", "permission": "allow", "flows": [direction], "messages": EVERY_MESSAGE, "key_exprs": ["**"]}
        )  # fmt: skip
        acl["subjects"].append({"id": "all", "link_protocols": ["tls"]})
        acl["policies"].append({"rules": ["open"], "subjects": ["all"]})
        return acl

    return rules


def joined(endpoint: str, identity: Identity | None = None) -> zenoh.Session:
    """A client's session: one try lasts a second at most, in which a busy machine may not answer."""
    end = time.monotonic() + ANSWER_S
    session = open_client(endpoint, lambda: time.monotonic() < end, identity)
    assert session is not None
    return session


@contextmanager
def client_of(gateway: Gateway, identity: Identity) -> Iterator[zenoh.Session]:
    with joined(gateway.public, identity) as session:
        yield session
