"""Strangers at the public listener: those who do not get in, those who may do nothing, and what either is told."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh
from rig_process import PATIENCE_S, free_port, wait_for

from guarded_router import ANSWER_S, joined
from made_keys import Keyring
from protocol.access import handshake
from protocol.access.handshake import why_refused
from protocol.access.identity import Identity
from protocol.access.roles import ROLES
from protocol.endpoint import host_and_port
from protocol.session import Public, client_config, open_access, open_client, open_router
from rig.network.ports import listens

RIG = "r"


@pytest.fixture(scope="module")
def keyring(tmp_path_factory: pytest.TempPathFactory) -> Keyring:
    return Keyring(tmp_path_factory.mktemp("keys"))


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Keyring:
    """Another authority, of another rig."""
    return Keyring(tmp_path_factory.mktemp("foreign"))


@pytest.fixture(scope="module")
def port() -> int:
    return free_port()


@contextmanager
def listening(public: Public) -> Iterator[zenoh.Session]:
    """The public listener, once it is there: Zenoh opens it on a thread of its own."""
    with open_access(NOBODY, public) as session:
        wait_for("the listener", lambda: listens(*host_and_port(public.endpoint)))
        yield session


@pytest.fixture(scope="module")
def router(keyring: Keyring, port: int) -> Iterator[zenoh.Session]:
    public = Public(f"tls/127.0.0.1:{port}", keyring.listener(), (RIG,), tuple(ROLES))
    with listening(public) as session:
        session.declare_queryable(
            f"drumstick/{RIG}/scene", lambda query: query.reply(query.key_expr, b"scene")
        )
        yield session


NOBODY = "tcp/127.0.0.1:9"  # the gateway's router, which is not there yet


def once(endpoint: str, identity: Identity | None = None) -> zenoh.Config:
    """A client that tries once: one that is refused would try again for a second."""
    config = client_config(endpoint, identity)
    config.insert_json5("connect/timeout_ms", "0")
    return config


def is_let_in(endpoint: str, identity: Identity | None) -> bool:
    try:
        zenoh.open(once(endpoint, identity)).close()
    except zenoh.ZError:
        return False
    return True


@contextmanager
def patient() -> Iterator[None]:
    """A handshake that the other end ends, however late: with its refusal, or by going."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(handshake, "_PATIENCE_S", 60.0)
        patch.setattr(handshake, "_ALERT_WITHIN_S", 60.0)
        yield


def words_of(endpoint: str, identity: Identity) -> str:
    with patient():
        refused = why_refused(endpoint, identity)
    assert refused is not None
    assert refused.somebody_is_there
    return refused.words


@pytest.mark.usefixtures("router")
def test_a_certificate_of_the_authority_gets_in(
    keyring: Keyring, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = keyring.identity("sound")
    monkeypatch.setattr(handshake, "_PATIENCE_S", 60.0)
    assert why_refused(f"tls/127.0.0.1:{port}", mine) is None
    assert is_let_in(f"tls/127.0.0.1:{port}", mine)  # at the first try
    session = open_client(f"tls/127.0.0.1:{port}", lambda: True, mine)
    assert session is not None
    with session:
        assert [r.ok is not None for r in session.get(f"drumstick/{RIG}/scene", timeout=ANSWER_S)] == [True]


@pytest.mark.usefixtures("router")
def test_nobody_without_a_certificate(keyring: Keyring, port: int) -> None:
    assert not is_let_in(f"tls/127.0.0.1:{port}", None)
    assert not is_let_in(f"tcp/127.0.0.1:{port}", None)  # plain TCP at the port of TLS
    config = once(f"tls/127.0.0.1:{port}")
    config.insert_json5("transport/link/tls/root_ca_certificate", f'"{keyring.authority}"')
    with pytest.raises(zenoh.ZError):
        zenoh.open(config)


@pytest.mark.usefixtures("router")
def test_nobody_with_another_authoritys_certificate(keyring: Keyring, foreign: Keyring, port: int) -> None:
    theirs = foreign.identity("sound")._replace(authority=keyring.authority)
    assert not is_let_in(f"tls/127.0.0.1:{port}", theirs)
    assert "our certificate is not of its authority" in words_of(f"tls/127.0.0.1:{port}", theirs)


@pytest.mark.usefixtures("router")
def test_nobody_whose_certificate_has_ended(keyring: Keyring, port: int) -> None:
    old = keyring.ended("sound")
    assert not is_let_in(f"tls/127.0.0.1:{port}", old)
    assert "our certificate is out of date there" in words_of(f"tls/127.0.0.1:{port}", old)


@pytest.mark.usefixtures("router")
def test_we_do_not_speak_to_another_authoritys_listener(
    keyring: Keyring, foreign: Keyring, port: int
) -> None:
    mine = keyring.identity("sound")._replace(authority=foreign.authority)
    assert not is_let_in(f"tls/127.0.0.1:{port}", mine)
    assert "its certificate is not of our authority" in words_of(f"tls/127.0.0.1:{port}", mine)


def test_we_do_not_speak_to_a_host_of_another_name(keyring: Keyring) -> None:
    port = free_port()
    elsewhere = Public(f"tls/127.0.0.2:{port}", keyring.listener(), (RIG,), tuple(ROLES))
    with listening(elsewhere):
        mine = keyring.identity("sound")
        assert not is_let_in(elsewhere.endpoint, mine)
        assert "its certificate is not for the name 127.0.0.2" in words_of(elsewhere.endpoint, mine)


@pytest.mark.parametrize("role", ["sound", "listener"])
def test_a_clients_certificate_makes_no_listener(keyring: Keyring, role: str) -> None:
    # A stolen one cannot stand in for the haptic machine: neither by its use nor by its (missing) names.
    port = free_port()
    false = Public(f"tls/127.0.0.1:{port}", keyring.identity(role), (RIG,), tuple(ROLES))
    with listening(false):
        mine = keyring.identity("panel")
        assert not is_let_in(f"tls/127.0.0.1:{port}", mine)
        assert "its certificate" in words_of(f"tls/127.0.0.1:{port}", mine)


def test_a_listeners_certificate_that_has_ended(keyring: Keyring, tmp_path: Path) -> None:
    from datetime import timedelta

    from rig.identity import certificates

    port = free_port()
    old = keyring.identity(
        "haptic", ("127.0.0.1",), days=1.0, begun=certificates.present() - timedelta(days=2)
    )
    public = Public(f"tls/127.0.0.1:{port}", old, (RIG,), tuple(ROLES))
    with listening(public):
        mine = keyring.identity("sound")
        assert not is_let_in(f"tls/127.0.0.1:{port}", mine)
        assert "its certificate is out of date" in words_of(f"tls/127.0.0.1:{port}", mine)


@pytest.mark.long
def test_a_link_ends_when_its_certificate_does(router: zenoh.Session, keyring: Keyring, port: int) -> None:
    short = keyring.identity("sound", days=30.0 / 86400.0)
    lost = threading.Event()
    with joined(f"tls/127.0.0.1:{port}", short) as session:
        wait_for("the link", lambda: "sound" in [link.auth_identifier for link in router.info.links()])
        listener = session.info.declare_link_events_listener(
            lambda event: lost.set() if event.kind == zenoh.SampleKind.DELETE else None
        )
        assert lost.wait(PATIENCE_S)
        wait_for("its end", lambda: "sound" not in [link.auth_identifier for link in router.info.links()])
        listener.undeclare()


def test_a_silent_or_absent_listener_is_told_as_such(keyring: Keyring) -> None:
    mine = keyring.identity("sound")
    refused = why_refused(f"tls/127.0.0.1:{free_port()}", mine)
    assert refused is not None
    assert not refused.somebody_is_there
    with socket.create_server(("127.0.0.1", 0)) as mute:
        refused = why_refused(f"tls/127.0.0.1:{mute.getsockname()[1]}", mine)
    assert refused is not None
    assert "no TLS server answers" in refused.words
    gone = mine._replace(private_key=mine.private_key.with_name("none.key"))
    refused = why_refused(f"tls/127.0.0.1:{free_port()}", gone)
    assert refused is not None
    assert "our own certificate, key or authority cannot be used" in refused.words


@pytest.mark.long
@pytest.mark.usefixtures("router")
def test_who_is_refused_hears_why_once_and_can_stop_waiting(
    keyring: Keyring, foreign: Keyring, port: int
) -> None:
    theirs = foreign.identity("sound")._replace(authority=keyring.authority)
    told: list[str] = []
    asked = 0

    def keep_trying() -> bool:
        nonlocal asked
        asked += 1
        return asked < 60  # two or three tries: it looks ten times a second while it waits

    with patient():
        assert open_client(f"tls/127.0.0.1:{port}", keep_trying, theirs, told.append) is None
    assert len(told) == 1
    assert "our certificate is not of its authority" in told[0]


def test_a_door_waits_for_its_network_and_for_the_gateways_router(keyring: Keyring) -> None:
    local, port = f"tcp/127.0.0.1:{free_port()}", free_port()
    public = Public(f"tls/127.0.0.1:{port}", keyring.listener(), (RIG,), tuple(ROLES))
    scene = f"drumstick/{RIG}/scene"

    def is_answered(client: zenoh.Session) -> bool:
        return [reply.ok is not None for reply in client.get(scene, timeout=5.0)] == [True]

    blocker = socket.create_server(("127.0.0.1", port))
    with open_access(local, public):
        blocker.close()
        far = open_client(f"tls/127.0.0.1:{port}", lambda: True, keyring.identity("sound"), lambda _: None)
        assert far is not None  # the listener was tried again
        with far:
            assert not is_answered(far)
            for _ in range(2):  # it comes, goes, and comes again
                with open_router(local) as router, joined(local) as near:
                    router.declare_queryable(
                        scene, lambda query: (query.reply(query.key_expr, b"s"), query.drop())
                    )
                    wait_for("the gateway's router", lambda: is_answered(near))
                    wait_for("the way through the door", lambda: is_answered(far))
                wait_for("its end", lambda: not is_answered(far))


def test_a_loopback_port_that_is_taken_is_told() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as blocker,
        pytest.raises(OSError, match="taken by another rig"),
    ):
        open_router(f"tcp/127.0.0.1:{blocker.getsockname()[1]}")
