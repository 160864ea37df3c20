"""Each role over a real TLS link: all that its row of the table says, and nothing else.

The test's router stands for the gateway: it answers on every key, hears every key and puts on every key. A role's work
is then tried on every key in every way that Zenoh has. The same again with rules that guard only one direction, because
a client that plays fair does not even send what nobody may hear: a forger's does.
"""

from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from rig_process import free_port, wait_for

from guarded_router import (
    ANSWER_S,
    EVERY_RIG,
    EVERYBODY,
    RIG,
    TAILS,
    TOKENS,
    Gateway,
    at_once,
    client_of,
    gateway_of,
    joined,
    key,
    of,
    seen_by,
    unguarded,
)
from made_keys import Keyring
from protocol.access.rules import access_control
from protocol.session import client_config, open_client

_TRIES = 20


@pytest.fixture(scope="module")
def keyring(tmp_path_factory: pytest.TempPathFactory) -> Keyring:
    return Keyring(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module", params=["as it is", "only what comes in is guarded"])
def gateway(request: pytest.FixtureRequest, keyring: Keyring) -> Iterator[Gateway]:
    rules = access_control if request.param == "as it is" else unguarded("egress")
    with gateway_of(keyring, rules=rules) as made:
        yield made


@pytest.mark.parametrize("name", EVERYBODY)
def test_puts_and_deletes_only_where_its_row_says_so(gateway: Gateway, keyring: Keyring, name: str) -> None:
    with client_of(gateway, keyring.identity(name)) as session:
        marked = name.encode()
        publishers = [session.declare_publisher(key(tail)) for tail in TAILS]
        gateway.settle(session, name)
        expected = {(key(tail), "put") for tail in of(EVERYBODY[name].publishes, *TAILS)}
        told: list[tuple[str, str]] = []
        # A client puts nothing before it was told of a subscriber, and that takes its time.
        for _ in range(_TRIES):
            gateway.put.clear()
            for publisher in publishers:
                publisher.put(marked)
            for tail in TAILS:
                session.put(key(tail), marked)
                session.put(key(tail, "other"), marked)
                session.delete(key(tail))
            gateway.settle(session, name)
            told = [
                (where, kind) for where, payload, kind in gateway.put if payload == marked or kind == "delete"
            ]
            if len(told) >= 2 * len(expected):
                break
    assert set(told) == expected
    assert len(told) == 2 * len(expected)  # by put, and by a declared publisher


@pytest.mark.parametrize("name", EVERYBODY)
def test_is_answered_only_where_its_row_says_so(gateway: Gateway, keyring: Keyring, name: str) -> None:
    with client_of(gateway, keyring.identity(name)) as session:
        gateway.settle(session, name)
        gateway.asked.clear()
        answered: set[str] = set()
        for rig in (RIG, "other"):
            for asked in (*TAILS, "*", "**", "set/*", "param/*", "p$*"):
                replies = list(session.get(key(asked, rig), payload=b"1", timeout=ANSWER_S))
                answered |= {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}
        everywhere = list(session.get("**", timeout=ANSWER_S))
        assert [reply for reply in everywhere if reply.ok is not None] == []
    expected = {key(tail) for tail in of(EVERYBODY[name].asks, *TAILS)}
    assert answered == expected
    assert set(gateway.asked) == expected  # nothing else reached the gateway at all


@pytest.mark.parametrize("name", EVERYBODY)
def test_answers_nobodys_queries(gateway: Gateway, keyring: Keyring, name: str) -> None:
    with client_of(gateway, keyring.identity(name)) as session:
        queryables = [
            session.declare_queryable(pattern, lambda query: query.reply(query.key_expr, b"forged"))
            for pattern in (*(key(tail) for tail in TAILS), key("**"), key("new"))
        ]
        gateway.settle(session, name)
        with joined(gateway.local) as local:
            gateway.settle(local)
            for asker in (gateway.session, local):
                for tail in (*TAILS, "new"):
                    replies = list(asker.get(key(tail), target=zenoh.QueryTarget.ALL, timeout=ANSWER_S))
                    got = [r.ok.payload.to_bytes() for r in replies if r.ok is not None]
                    assert got == ([] if tail == "new" else [b"gateway"]), tail
        for queryable in queryables:
            queryable.undeclare()


@pytest.mark.parametrize("name", EVERYBODY)
def test_is_seen_only_as_what_it_is(gateway: Gateway, keyring: Keyring, name: str) -> None:
    wait_for("those who came before to be forgotten", lambda: not seen_by(gateway.session))
    with client_of(gateway, keyring.identity(name)) as session:
        tokens = [session.liveliness().declare_token(key(tail)) for tail in TOKENS]
        gateway.settle(session, name)
        assert seen_by(gateway.session) == {key(tail) for tail in of(EVERYBODY[name].is_seen_as, *TOKENS)}
        assert len(tokens) == len(TOKENS)


@pytest.fixture(scope="module", params=["as it is", "only what goes out is guarded"])
def leaky(request: pytest.FixtureRequest, keyring: Keyring) -> Iterator[Gateway]:
    """As `gateway`, with what goes out as the last guard."""
    rules = access_control if request.param == "as it is" else unguarded("ingress")
    with gateway_of(keyring, rules=rules) as made:
        yield made


@pytest.mark.parametrize("name", EVERYBODY)
def test_hears_only_what_its_row_says(leaky: Gateway, keyring: Keyring, name: str) -> None:
    heard: list[str] = []
    with client_of(leaky, keyring.identity(name)) as session:
        for pattern in (
            *(key(tail) for tail in TAILS),
            *(key(tail, "other") for tail in TAILS),
            "drumstick/**",
            "**",
        ):
            session.declare_subscriber(pattern, at_once(lambda sample: heard.append(str(sample.key_expr))))
        leaky.settle(session, name)
        with joined(leaky.local) as local:
            for source in (leaky.session, local):
                for tail in TAILS:
                    source.put(key(tail), b"told")
                    source.put(key(tail, "other"), b"told")
            leaky.settle(local)
        leaky.settle(session, name)
    assert set(heard) == {key(tail) for tail in of(EVERYBODY[name].subscribes, *TAILS)}


@pytest.mark.parametrize("name", EVERYBODY)
def test_sees_only_the_tokens_that_its_row_says(leaky: Gateway, keyring: Keyring, name: str) -> None:
    shown: list[str] = []
    every = {key(tail, rig) for tail in TOKENS for rig in (RIG, "other")}
    tokens = [leaky.session.liveliness().declare_token(each) for each in every]
    try:
        wait_for("the tokens at the door", lambda: seen_by(leaky.door) == every)
        with client_of(leaky, keyring.identity(name)) as session:
            expected = {key(tail) for tail in of(EVERYBODY[name].sees, *TOKENS)}
            asked: set[str] = set()
            patterns = (*(key(tail) for tail in TOKENS), key("alive/*/*"), *EVERY_RIG, "**")

            def ask() -> bool:
                for pattern in patterns:
                    replies = list(session.liveliness().get(pattern, timeout=ANSWER_S))
                    asked.update(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)
                return asked >= expected and set(shown) >= expected

            for pattern in patterns:
                session.liveliness().declare_subscriber(
                    pattern, at_once(lambda sample: shown.append(str(sample.key_expr))), history=True
                )
            # A router that has just heard of a session may answer its first question with nothing.
            wait_for("the tokens that the row says", ask)
            leaky.settle(session, name)
            ask()
            assert (asked, set(shown)) == (expected, expected)
    finally:
        for token in tokens:
            token.undeclare()


def test_a_role_that_is_not_admitted_may_do_nothing(keyring: Keyring) -> None:
    with (
        gateway_of(keyring, roles=("sound",)) as gateway,
        client_of(gateway, keyring.identity("panel")) as session,
    ):
        assert list(session.get(key("panic"), timeout=ANSWER_S)) == []
        session.put(key("pointer"), b"x")
        gateway.settle(session, "stranger")
        assert gateway.put == []
        assert gateway.asked == []


def test_local_processes_may_do_everything_and_advanced_publishers_too(keyring: Keyring) -> None:
    import zenoh.ext

    heard: list[bytes] = []
    with gateway_of(keyring) as gateway:
        one = open_client(gateway.local, lambda: True)
        two = open_client(gateway.local, lambda: True)
        assert one is not None
        assert two is not None
        with one, two:
            publisher = zenoh.ext.declare_advanced_publisher(
                one,
                key("state"),
                cache=zenoh.ext.CacheConfig(3),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
                publisher_detection=True,
            )
            publisher.put(b"before")
            gateway.settle(one)
            subscriber = zenoh.ext.declare_advanced_subscriber(
                two,
                key("state"),
                lambda sample: heard.append(sample.payload.to_bytes()),
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            )
            gateway.settle(two)
            gateway.settle(one)
            one.put(key("strike"), b"s")
            assert list(two.get(key("panic"), timeout=ANSWER_S))
            gateway.settle(one)
            # Where the cache is announced after the subscriber has asked, its publisher is found a moment later.
            wait_for("what was said before", lambda: b"before" in heard)
            subscriber.undeclare()
            publisher.undeclare()
        assert (key("strike"), b"s", "put") in gateway.put


def test_what_is_longer_than_a_message_may_be_is_not_taken_and_disturbs_nobody(
    keyring: Keyring,
) -> None:
    with (
        gateway_of(keyring) as gateway,
        joined(gateway.local) as local,
        client_of(gateway, keyring.identity("sound")) as session,
    ):
        gateway.settle(session, "sound")

        def is_heard() -> bool:
            session.put(key("meter"), b"m")  # nothing goes out before the session was told of a subscriber
            gateway.settle(session, "sound")
            return bool(gateway.put)

        wait_for("a message that is short enough", is_heard)
        session.put(key("meter"), bytes(5_000_000), congestion_control=zenoh.CongestionControl.BLOCK)
        gateway.settle(local)
        assert {len(payload) for _, payload, _ in gateway.put} == {1}
        assert list(local.get(key("clock"), timeout=ANSWER_S))


@pytest.mark.long
@pytest.mark.parametrize("mode", ["router", "peer"])
@pytest.mark.parametrize("name", ["listener", "sound", "stranger"])
@pytest.mark.parametrize("rules", [access_control, unguarded("egress")], ids=["as it is", "only in"])
def test_who_says_to_be_a_router_or_a_peer_may_do_no_more(
    keyring: Keyring, mode: str, name: str, rules: Any
) -> None:
    # A door of its own: a router that comes while another one goes was seen never to be told of anything.
    with gateway_of(keyring, rules=rules) as gateway:
        _tried_as(mode, name, gateway, keyring)


def _tried_as(mode: str, name: str, gateway: Gateway, keyring: Keyring) -> None:
    # A router tells of others behind it; its link has the same certificate, and the same rules.
    behind = f"tcp/127.0.0.1:{free_port()}"
    config = client_config(gateway.public, keyring.identity(name))
    config.insert_json5("connect/timeout_ms", str(round(1e3 * ANSWER_S)))
    config.insert_json5("mode", f'"{mode}"')
    config.insert_json5("listen/endpoints", f'["{behind}"]')
    heard: list[str] = []
    with zenoh.open(config) as false, joined(behind) as client:
        wait_for("the link", lambda: name in [link.auth_identifier for link in gateway.door.info.links()])
        queryables = [
            s.declare_queryable(key("**"), lambda q: q.reply(q.key_expr, b"forged")) for s in (false, client)
        ]
        tokens = [s.liveliness().declare_token(key("alive/haptic/1")) for s in (false, client)]
        for session in (false, client):
            session.declare_subscriber("**", at_once(lambda sample: heard.append(sample.payload.to_string())))
            gateway.settle(session, name)
        gateway.put.clear()
        gateway.asked.clear()
        for session in (false, client):
            for tail in TAILS:
                session.put(key(tail), b"forged")
                list(session.get(key(tail), payload=b"1", target=zenoh.QueryTarget.ALL, timeout=ANSWER_S))
            session.get("**", timeout=0.3)
        for tail in TAILS:
            gateway.session.put(key(tail), b"told")
        # A router that is a stranger, and is told of nothing, has nobody to send to: there is nothing to wait for.
        for session in (false, client):
            gateway.settle(session, name)
        row = EVERYBODY[name]
        assert {where for where, payload, _ in gateway.put if payload == b"forged"} <= {
            key(tail) for tail in of(row.publishes, *TAILS)
        }
        assert set(gateway.asked) <= {key(tail) for tail in of(row.asks, *TAILS)}
        assert "told" not in heard  # `**` is in nobody's row
        replies = list(gateway.session.get(key("panic"), target=zenoh.QueryTarget.ALL, timeout=ANSWER_S))
        assert [r.ok.payload.to_bytes() for r in replies if r.ok is not None] == [b"gateway"]
        seen = list(gateway.session.liveliness().get(key("alive/haptic/*"), timeout=ANSWER_S))
        assert [reply for reply in seen if reply.ok is not None] == []
        assert len(queryables) == len(tokens) == 2
