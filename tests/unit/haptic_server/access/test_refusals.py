"""Zenoh's log of those it turned away, counted; a flood of it makes few lines of ours."""

import logging

import pytest

from haptic_server.access.disconnection import TURNED_BACK_S
from haptic_server.access.refusals import Refusals
from haptic_server.access.session_limits import MOST

# As Zenoh 1.10 writes them, colours included.
HANDSHAKE = (
    "\x1b[2m2026-11-21T22:05:20.847225Z\x1b[0m \x1b[33m WARN\x1b[0m acc-0 ThreadId(04)"
    " \x1b[2mzenoh_link_tls::unicast\x1b[0m\x1b[2m:\x1b[0m {}. Hint: increase the system open file limit."
)
NO_ROLE = (
    "\x1b[2m2026-11-21T22:05:28.360926Z\x1b[0m \x1b[32m INFO\x1b[0m acc-0 ThreadId(04)"
    " \x1b[2mzenoh::net::routing::interceptor::access_control\x1b[0m\x1b[2m:\x1b[0m 2a493df3ed27dfe8edae60b7ceb99959"
    " did not match any configured ACL subject. Default permission `Deny` will be applied on all messages"
)


def test_each_kind_is_counted_and_the_last_is_told() -> None:
    refusals = Refusals(lambda: 0.0)
    refusals.take(HANDSHAKE.format("peer sent no certificates"))
    refusals.take(HANDSHAKE.format("invalid peer certificate: UnknownIssuer"))
    assert refusals.counters() == {
        "handshakes_refused": 2,
        "without_role": 0,
        "beyond_role": {},
        "over_limit": {},
        "last": "a handshake failed: invalid peer certificate: UnknownIssuer",
    }
    refusals.take(NO_ROLE)
    assert (refusals.handshakes, refusals.without_role) == (2, 1)


def test_a_flood_makes_one_line_in_ten_seconds(caplog: pytest.LogCaptureFixture) -> None:
    now = 0.0
    refusals = Refusals(lambda: now)
    with caplog.at_level(logging.WARNING):
        for number in range(600):
            now = number * 0.1
            refusals.take(HANDSHAKE.format("peer sent no certificates"))
    assert refusals.handshakes == 600
    assert len(caplog.messages) == 6
    assert caplog.messages[0] == (
        "public listener: refused 1, last: a handshake failed: peer sent no certificates"
    )
    assert caplog.messages[1].startswith("public listener: refused 100, ")


def test_what_is_no_refusal_is_handed_on(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    refusals.take("\x1b[2m2026\x1b[0m ERROR net-0 zenoh::net::runtime: something else\n")
    refusals.take("\x1b[2m2026\x1b[0m ERROR net-0 zenoh::net::runtime: and again\n")
    refusals.take("\n")
    assert caplog.messages == ["2026 ERROR net-0 zenoh::net::runtime: something else"]
    assert refusals.counters()["handshakes_refused"] == 0


def rule(words: str, thread: int = 8) -> str:
    return (
        f"\x1b[2m2026-11-22T01:27:55.495398Z\x1b[0m \x1b[35mTRACE\x1b[0m rx-0 ThreadId({thread:02d})"
        f" \x1b[2mzenoh::net::routing::interceptor::access_control\x1b[0m\x1b[2m:\x1b[0m {words}"
    )


WHO = "2a493df3ed27dfe8edae60b7ceb99959"
LISTENER = f"{WHO} on Interface(lo)+CertCommonName(listener)+Transport(Tls)+{WHO}"
KINDS = (
    "Query", "Reply", "Put", "Delete", "Declare/Undeclare Subscriber", "Declare/Undeclare Queryable",
    "Declare/Undeclare Liveliness Token", "Liveliness Query", "Declare Liveliness Subscriber",
)  # fmt: skip


def foresee(refusals: Refusals, flow: str, thread: int = 8) -> None:
    """As Zenoh does for each key that somebody declares."""
    refusals.take(rule(f"ACL ({flow}): caching permissions for `drumstick/r/strike` ...", thread))
    for kind in KINDS:
        word = "authorized" if "Subscriber" in kind else "unauthorized"
        refusals.take(rule(f"{LISTENER} is {word} to {kind} ({flow}) on drumstick/r/strike", thread))


def test_what_is_beyond_a_role_is_counted_and_what_only_was_foreseen_is_not() -> None:
    refusals = Refusals(lambda: 0.0)
    for flow in ("ingress", "egress"):
        foresee(refusals, flow)
    refusals.take(rule(f"Using cached result: {WHO} is authorized to Put (egress) on drumstick/r/strike"))
    refusals.take(rule(f"Using cached result: {WHO} is unauthorized to Put (egress) on drumstick/r/release"))
    assert refusals.beyond_role == {}
    refusals.take(rule(f"Using cached result: {WHO} is unauthorized to Put (ingress) on drumstick/r/strike"))
    assert refusals.last == "listener may not put on drumstick/r/strike"
    refusals.take(rule(f"{LISTENER} is unauthorized to Query (ingress) on drumstick/r/set/m"))
    assert refusals.beyond_role == {"listener": 2}
    assert refusals.last == "listener may not query on drumstick/r/set/m"


def test_threads_that_log_at_once_are_kept_apart() -> None:
    refusals = Refusals(lambda: 0.0)
    refusals.take(rule("ACL (ingress): caching permissions for `drumstick/r/a` ...", 1))
    refusals.take(rule(f"{LISTENER} is unauthorized to Query (ingress) on drumstick/r/set/m", 2))
    assert refusals.beyond_role == {"listener": 1}


def test_a_key_of_which_nothing_was_foreseen_hides_no_refusal_of_another() -> None:
    """A session without a role declares a key: its permissions are none, and Zenoh says nothing more of them."""
    refusals = Refusals(lambda: 0.0)
    refusals.take(rule("ACL (ingress): caching permissions for `drumstick/r/a` ..."))
    for number in range(9):
        refusals.take(rule(f"{LISTENER} is unauthorized to Put (ingress) on drumstick/r/{number}/a"))
    assert refusals.beyond_role == {"listener": 9}


def test_a_line_of_rules_is_never_handed_on(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals(lambda: 0.0)
    foresee(refusals, "ingress")
    refusals.take(rule("Access control is enabled"))
    assert caplog.messages == []


def test_names_that_clients_choose_feign_nothing_and_fill_no_log(caplog: pytest.LogCaptureFixture) -> None:
    now = 0.0
    refusals = Refusals(lambda: now)
    forged = (
        "drumstick/r/x\nzenoh_link_tls::unicast: forged. Hint: \n"
        "2026-11-22T01:27:55.495398Z TRACE rx-0 ThreadId(08) zenoh::net::routing::interceptor::access_control:"
        f" {WHO} did not match any configured ACL subject\n"
    )
    named = "ACL (ingress): caching permissions for `zenoh_link_tls: x. Hint: "
    for number in range(50):
        for line in rule(f"{LISTENER} is unauthorized to Put (ingress) on {forged}").splitlines():
            refusals.take(line)
        refusals.take(rule(f"{LISTENER} is unauthorized to Put (ingress) on drumstick/r/{number}/{named}"))
    assert refusals.counters() == {
        "handshakes_refused": 0,
        "without_role": 0,
        "beyond_role": {"listener": 100},
        "over_limit": {},
        "last": "listener may not put on drumstick/r/49/ACL",
    }
    assert len(caplog.messages) == 1


def test_who_declares_beyond_the_limit_is_named_and_ended() -> None:
    refusals = Refusals(lambda: 0.0)
    ended: list[str] = []
    refusals.cut = ended.append
    foresee(refusals, "ingress")  # from which the role is known
    most, words = MOST["Liveliness Token"]
    for number in range(most):
        key = f"drumstick/r/alive/record/{number}"
        for _ in range(2):  # told again, it is no other one
            refusals.take(
                rule(f"Using cached result: {WHO} is authorized to Liveliness Token (ingress) on {key}")
            )
    refusals.take(
        rule(f"{WHO} on Interface(lo)+Transport(Tcp) is authorized to Query (ingress) on drumstick/r/x")
    )
    assert (ended, refusals.over_limit) == ([], {})
    refusals.take(
        rule(
            f"Using cached result: {WHO} is authorized to Liveliness Token (ingress) on drumstick/r/alive/record/x"
        )
    )
    assert ended == [WHO]
    assert refusals.counters()["over_limit"] == {"listener": 1}
    assert refusals.last == (
        f"listener (session {WHO}) has more than {most} {words}, the limit of one session: its link was ended,"
        f" and it is turned back for {TURNED_BACK_S:g} s"
    )
