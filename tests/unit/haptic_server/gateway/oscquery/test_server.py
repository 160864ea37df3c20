"""The server on loopback, without a rig: what is answered, listened to, written, refused and bounded."""

import json
import socket
import threading
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.oscquery import client as clients
from haptic_server.gateway.oscquery import server as servers
from haptic_server.gateway.oscquery.osc_bridge import OscBridge
from haptic_server.gateway.oscquery.server import OscQuery
from osc_bench import BOUND_S, FakeParameters, built, client
from oscquery_bench import connected_deaf, frame, get, listening, served, told, until

PATH = "/drumstick/param/dv_pls"


@pytest.fixture
def parameters() -> FakeParameters:
    return FakeParameters()


@pytest.fixture
def both(parameters: FakeParameters) -> Iterator[tuple[OscQuery, OscServer]]:
    with served(parameters) as opened:
        yield opened


@pytest.fixture
def query(both: tuple[OscQuery, OscServer]) -> OscQuery:
    return both[0]


@pytest.fixture
def front(both: tuple[OscQuery, OscServer]) -> OscServer:
    return both[1]


@pytest.fixture
def port(query: OscQuery) -> int:
    return query.endpoint[1]


def received(listener: ClientConnection) -> tuple[str, list[object]]:
    packet = listener.recv(timeout=BOUND_S)
    assert isinstance(packet, bytes)
    message = OscMessage(packet)
    return message.address, message.params


def pinged(listener: ClientConnection) -> None:
    """All that was sent before is done with."""
    listener.send(built("/drumstick/ping"))
    while received(listener)[0] != "/drumstick/pong":
        pass


def test_questions_over_http(port: int, front: OscServer) -> None:
    assert told(port)["CONTENTS"]["drumstick"]["FULL_PATH"] == "/drumstick"
    info = told(port, "/?HOST_INFO")
    assert info["NAME"] == "drumstick main"
    assert (info["OSC_IP"], info["OSC_PORT"], info["OSC_TRANSPORT"]) == (*front.endpoint, "UDP")
    assert (info["WS_IP"], info["WS_PORT"]) == ("127.0.0.1", port)
    assert info["EXTENSIONS"]["LISTEN"] is True
    assert get(port, "/nowhere")[0] == 404
    assert get(port, "/drumstick?NONSENSE")[0] == 400
    status, headers, body = get(port, "/drumstick/panic?VALUE")
    assert (status, body) == (204, b"")
    assert "content-length" not in headers


def test_value_follows_the_desk(port: int, parameters: FakeParameters) -> None:
    parameters.set({"dv_pls": 0.375}, "test")
    assert told(port, f"{PATH}?VALUE") == {"VALUE": [0.375]}


def test_a_listener_gets_what_is_sent_to_its_address_and_nothing_else(port: int, front: OscServer) -> None:
    with listening(port, PATH, "/drumstick/level") as listener:
        pinged(listener)
        front.readback("k_coll", 5000.0, 0.5)
        front.readback("dv_pls", 0.5, 0.25)
        front.alive("main", "ready", 4)
        assert received(listener) == (PATH, [0.5])
        listener.send(json.dumps({"COMMAND": "IGNORE", "DATA": PATH}))
        listener.send(json.dumps({"COMMAND": "LISTEN", "DATA": "/drumstick/alive"}))
        pinged(listener)
        front.readback("dv_pls", 0.625, 0.25)
        front.alive("main", "ready", 5)
        assert received(listener) == ("/drumstick/alive", ["main", "ready", 5])
    assert told(port, "/drumstick/alive?VALUE") == {"VALUE": ["main", "ready", 5]}


def test_what_is_written_is_heard_as_osc_is(port: int, parameters: FakeParameters, query: OscQuery) -> None:
    with listening(port) as writer:
        writer.send(built(PATH, 0.5))
        writer.send(built("/drumstick/ping", 7))
        assert received(writer) == ("/drumstick/pong", [7])
        assert parameters.sets[-1][0] == {"dv_pls": 0.5}
        assert parameters.sets[-1][1].startswith("osc 127.0.0.1:")
        writer.send(built(PATH, 1e9))
        address, (refused, why) = received(writer)
        assert (address, refused) == ("/drumstick/error", PATH)
        assert "outside" in str(why)
        writer.send(built("/drumstick/panic"))
        assert parameters.panicked.wait(BOUND_S)


def test_each_writer_has_a_lease_of_its_own(port: int, parameters: FakeParameters) -> None:
    with listening(port) as one, listening(port) as other:
        one.send(built("/drumstick/lease", "one"))
        assert received(one) == ("/drumstick/lease", ["one", 5.0])
        other.send(built(PATH, 0.5))
        assert "one is tuning" in str(received(other)[1][1])
        assert not parameters.sets
        one.send(built(PATH, 0.25))
        one.send(built("/drumstick/ping"))
        assert received(one)[0] == "/drumstick/pong"
        assert parameters.sets[-1][0] == {"dv_pls": 0.25}


@pytest.mark.parametrize(
    "mistake",
    [
        "", "no JSON", "[]", "1", "null", "{}", '{"COMMAND": "LISTEN"}', '{"DATA": "/drumstick/level"}',
        '{"COMMAND": "LISTEN", "DATA": 1}', '{"COMMAND": "LISTEN", "DATA": "/nowhere"}',
        '{"COMMAND": "LISTEN", "DATA": "drumstick"}', '{"COMMAND": "LISTEN", "DATA": "/drumstick/panic"}',
        '{"COMMAND": "LISTEN", "DATA": "/drumstick/*"}', '{"COMMAND": "listen", "DATA": "/drumstick/level"}',
        '{"COMMAND": "PATH_ADDED", "DATA": "/drumstick/level"}', "[" * 1500, b"",
    ],
)  # fmt: skip
def test_a_mistake_changes_nothing_and_is_counted(
    mistake: str | bytes, port: int, query: OscQuery, front: OscServer
) -> None:
    with listening(port, PATH) as listener:
        listener.send(mistake)
        pinged(listener)
        assert query.counters["mistakes"] == 1
        front.readback("dv_pls", 0.5, 0.25)
        assert received(listener) == (PATH, [0.5])


def test_who_makes_too_many_mistakes_is_sent_away(
    port: int, query: OscQuery, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clients, "MAX_MISTAKES", 3)
    with listening(port) as listener:
        for _ in range(4):
            listener.send("x")
        with pytest.raises(ConnectionClosed) as closed:
            listener.recv(timeout=BOUND_S)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008


def test_a_message_that_is_too_long_ends_the_connection(port: int, query: OscQuery) -> None:
    with listening(port) as listener:
        listener.send(b"x" * 4096)
        with pytest.raises(ConnectionClosed):
            listener.recv(timeout=BOUND_S)
    assert told(port, "/?HOST_INFO")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
    ],
)
def test_a_strangers_page_can_neither_read_nor_listen(
    headers: dict[str, str], status: int, port: int
) -> None:
    assert get(port, "/", headers)[0] == status
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    assert get(port, "/", upgrade)[0] == 101
    assert get(port, "/", upgrade | headers)[0] == status


def test_sources_that_are_not_allowed_get_no_answer(parameters: FakeParameters) -> None:
    inlet = OscBridge("127.0.0.1")
    with client() as there:
        query = OscQuery(("127.0.0.1", 0), "main", "/drumstick", parameters, there.endpoint, inlet, allow=())
        try:
            with pytest.raises(OSError):  # noqa: PT011  reset or closed, as the system has it
                get(query.endpoint[1])
            assert query.counters["source"] == 1
        finally:
            query.close()


def test_a_taken_port_is_an_error_and_closes_nothing_else(parameters: FakeParameters, port: int) -> None:
    inlet = OscBridge("127.0.0.1")
    try:
        with pytest.raises(OSError, match="in use"):
            OscQuery(("127.0.0.1", port), "main", "/drumstick", parameters, ("127.0.0.1", 9), inlet)
    finally:
        inlet.close()
    assert told(port, "/?HOST_INFO")


def test_more_clients_than_are_served(port: int, query: OscQuery, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(servers, "MAX_CLIENTS", 1)
    with listening(port) as first:
        pinged(first)
        with pytest.raises(InvalidStatus) as refused:
            connect(f"ws://127.0.0.1:{port}/")
        assert refused.value.response.status_code == 503
        assert told(port, "/?HOST_INFO")
    until("the first to be gone", lambda: query.counters["clients"] == 0)
    with listening(port) as second:
        pinged(second)


def test_half_open_connections_are_bounded_and_leave_room_again(
    parameters: FakeParameters, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(servers, "_OPEN_WITHIN_S", BOUND_S)
    with served(parameters) as (query, _):
        _fill_and_empty(query)


def _fill_and_empty(query: OscQuery) -> None:
    port = query.endpoint[1]
    idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(servers.MAX_CONNECTIONS)]
    until("all of them", lambda: query._open == servers.MAX_CONNECTIONS)
    with pytest.raises(OSError):  # noqa: PT011  reset or closed, as the system has it
        get(port)
    assert query.counters["crowded"] == 1
    for each in idle:
        each.close()
    until("room", lambda: query._open == 0)
    assert told(port, "/?HOST_INFO")


def test_a_connection_that_says_nothing_is_closed(
    parameters: FakeParameters, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(servers, "_OPEN_WITHIN_S", 0.05)
    with served(parameters) as (query, _), socket.create_connection(query.endpoint) as idle:
        idle.settimeout(BOUND_S)
        idle.sendall(b"GET / HTTP/1.1\r\n")
        assert idle.recv(1024) == b""


@pytest.mark.parametrize(
    "request_line",
    [
        b"\x00" * 100, b"GET\r\n\r\n", b"GET / HTTP/0.9\r\n\r\n", b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET /\xff\xfe HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 1000 + b"\r\n", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n",
    ],
)  # fmt: skip
def test_what_is_no_request_is_answered_by_the_end_of_the_connection(request_line: bytes, port: int) -> None:
    with socket.create_connection(("127.0.0.1", port)) as there:
        there.settimeout(BOUND_S)
        try:
            there.sendall(request_line)
            there.shutdown(socket.SHUT_WR)
            answer = b"".join(iter(lambda: there.recv(65536), b""))
        except OSError:
            answer = b""  # reset: it did not read all of it
        assert b" 200 " not in answer
        assert b" 101 " not in answer
    assert told(port, "/?HOST_INFO")


def test_a_flood_of_questions_is_answered_only_so_often(
    port: int, query: OscQuery, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(query._loop, "time", lambda: 0.5)  # in one second, however long it takes
    most = servers.QUESTIONS_A_SECOND[0]
    answers = [get(port, "/?HOST_INFO") for _ in range(most + 10)]
    assert [status for status, _, _ in answers] == [200] * most + [503] * 10
    assert answers[-1][1]["retry-after"] == "1"


def test_a_slow_reader_is_dropped_and_the_others_served(port: int, query: OscQuery, front: OscServer) -> None:
    with connected_deaf(port) as deaf, listening(port, "/drumstick/error") as listener:
        pinged(listener)
        deaf.sendall(frame(json.dumps({"COMMAND": "LISTEN", "DATA": "/drumstick/error"}).encode()))
        until("both", lambda: query.counters["clients"] == 2)
        got = 0

        def read() -> None:
            nonlocal got
            while got < 20_000:
                listener.recv(timeout=BOUND_S)
                got += 1
                if query.counters.get("slow"):
                    return

        reader = threading.Thread(target=read)
        reader.start()
        sent = 0
        while reader.is_alive():
            front.error("/drumstick/x", "y" * 400)
            sent += 1
            until("the listener", lambda sent=sent: got >= sent - 50)
        reader.join()
        assert query.counters["slow"] == 1
        until("one client", lambda: query.counters["clients"] == 1)
        pinged(listener)


def test_close_ends_everything_and_may_be_called_twice(parameters: FakeParameters) -> None:
    with served(parameters) as (query, _), listening(query.endpoint[1], PATH) as listener:
        query.close()
        query.close()
        with pytest.raises(ConnectionClosed):
            listener.recv(timeout=BOUND_S)
        with pytest.raises(OSError):  # noqa: PT011  refused
            get(query.endpoint[1])


def test_a_fault_of_ours_is_told_once_and_answered(
    port: int,
    query: OscQuery,
    parameters: FakeParameters,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(query._loop, "time", lambda: 0.5)  # in one second, however long it takes
    parameters.broken = True
    for _ in range(3):
        assert get(port, f"{PATH}?VALUE")[0] == 500
    parameters.broken = False
    assert get(port, f"{PATH}?VALUE")[0] == 200
    told_lines = [record for record in caplog.records if "a fault in" in record.message]
    assert len(told_lines) == 1


COMMANDS = st.builds(
    lambda command, data: json.dumps({"COMMAND": command, "DATA": data}),
    st.sampled_from(("LISTEN", "IGNORE", "PATH_ADDED")),
    st.recursive(st.none() | st.floats() | st.text(max_size=30), lambda inner: st.lists(inner, max_size=3)),
).filter(lambda command: len(command) <= 1000)  # longer ones end the connection, see above


@given(st.lists(st.binary(max_size=200) | st.text(max_size=200) | COMMANDS, max_size=20))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
def test_no_message_ends_the_server(port: int, front: OscServer, messages: list[bytes | str]) -> None:
    with listening(port, PATH) as listener:
        for message in messages:
            listener.send(message)
        pinged(listener)
        front.readback("dv_pls", 0.5, 0.25)
        while received(listener) != (PATH, [0.5]):
            pass


def test_who_is_admitted_here_is_heard_whatever_the_front_allows_by_address(
    parameters: FakeParameters,
) -> None:
    # All of it is on 127.0.0.1 here; the WebSocket client stands for one that came by another address.
    inlet = OscBridge("127.0.0.1")
    front = OscServer(
        ("127.0.0.1", 0), [inlet.endpoint], "/drumstick", parameters, parameters.load_preset, allow=()
    )
    query = OscQuery(
        ("127.0.0.1", 0), "main", "/drumstick", parameters, front.endpoint, inlet, insiders=front.insiders
    )
    try:
        with listening(query.endpoint[1]) as listener, client() as stranger:
            pinged(listener)
            listener.send(built("/drumstick/panic"))
            until("the panic", lambda: bool(parameters.panics))
            listener.send(built("/drumstick/unsubscribe"))
            assert received(listener)[0] == "/drumstick/error"
            listener.send(built("/drumstick/subscribe", 9999))
            assert received(listener)[0] == "/drumstick/error"
            stranger.udp.sendto(built("/drumstick/panic"), front.endpoint)
            until("the refusal", lambda: front.counters.get("source", 0) == 1)
            assert len(parameters.panics) == 1
        until("the end of the client", lambda: front.insiders == set())
    finally:
        query.close()
        front.close()
