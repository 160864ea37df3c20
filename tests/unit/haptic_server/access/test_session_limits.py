"""Limits of what a stranger may declare, by kind and session, and the end of the link of one that goes beyond."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zenoh
from rig_process import ask, free_port, wait_for

from guarded_router import joined
from haptic_server.access.options import AccessOptions
from haptic_server.access.session_limits import MOST, SessionLimits
from made_keys import Keyring
from osc_bench import Time
from protocol.access.roles import ROLES
from protocol.session import Public, open_client, open_router
from realtime.service_options import command


def test_each_session_has_its_own_limit_of_each_kind() -> None:
    allowances = SessionLimits()
    for kind, (most, words) in MOST.items():
        for who in ("a1", "b2"):
            assert not any(allowances.spend(who, kind, f"key {number}") for number in range(most))
            assert not allowances.spend(who, kind, "key 0")
        assert allowances.spend("a1", kind, "one more") == f"more than {most} {words}"
        assert not allowances.spend("a1", kind, "one more")  # a link that ended begins anew
    assert not any(allowances.spend("a1", "Put", str(number)) for number in range(10_000))


def test_a_flood_of_queries_is_ended_once_and_a_fader_is_not() -> None:
    now = Time()
    allowances = SessionLimits(now)
    ended: list[tuple[str, str]] = []
    for _ in range(
        3000
    ):  # 3 s: one asks 1000 times a second, the others 200 times; all set the same parameter
        now.s += 0.001
        who = ["flood", *(["fader", "panel"] if round(now.s * 1000) % 5 == 0 else [])]
        ended += [(each, over) for each in who if (over := allowances.spend(each, "Query", "set/dv_pls"))]
    assert ended == [("flood", "more than 500 queries a second for 2 s")]
    now.s += 61.0  # it was turned back for a minute, and begins anew
    assert not allowances.spend("flood", "Query", "set/dv_pls")


def test_what_is_remembered_is_bounded() -> None:
    allowances = SessionLimits()
    for number in range(10_000):
        allowances.spend(f"{number:x}", "Query", "x" * 1000)
    assert len(vars(allowances)["_named"]) == 2000


@contextmanager
def door_of(keyring: Keyring, local: str, public: str) -> Iterator[None]:
    listener = Public(public, keyring.listener(), ("r",), tuple(ROLES))
    options = AccessOptions(connect=local, public=listener)
    with subprocess.Popen(command("haptic_server.access", options)) as door:
        try:
            yield
        finally:
            door.terminate()


def test_a_listener_with_too_many_tokens_is_ended_and_named(tmp_path: Path) -> None:
    keyring = Keyring(tmp_path / "keys")
    local, public = f"tcp/127.0.0.1:{free_port()}", f"tls/127.0.0.1:{free_port()}"
    most, words = MOST["Liveliness Token"]
    lost: list[zenoh.SampleKind] = []
    with open_router(local) as router, door_of(keyring, local, public):

        def told() -> Any:
            return json.loads(ask(router, "drumstick/r/door"))

        assert told()["over_limit"] == {}
        far = open_client(public, lambda: True, keyring.identity("listener"), lambda _: None)
        assert far is not None
        with far, joined(public, keyring.identity("technician")) as good:
            links = far.info.declare_link_events_listener(lambda event: lost.append(event.kind))
            tokens = [
                far.liveliness().declare_token(f"drumstick/r/alive/record/{number}") for number in range(most)
            ]
            wait_for("its role", lambda: told()["present"].get("listener") == 1)
            assert told()["over_limit"] == {}
            tokens += [
                far.liveliness().declare_token(f"drumstick/r/alive/record/x{number}") for number in range(9)
            ]
            wait_for("its end", lambda: zenoh.SampleKind.DELETE in lost)
            wait_for("the words", lambda: f"has more than {most} {words}" in told()["last"])
            assert told()["over_limit"]["listener"]
            # It comes back by itself, and is turned back; whoever kept within its limits goes on, and comes in.
            wait_for("its return", lambda: told()["turned_back"].get("listener", 0) >= 2)
            with joined(public, keyring.identity("panel")) as other:
                assert ask(other, "drumstick/r/door")
            assert set(told()["turned_back"]) == {"listener"}
            assert ask(good, "drumstick/r/door")
            links.undeclare()
