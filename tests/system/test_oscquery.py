"""OSCQuery on a rig of real processes: values, listening, and guests who mean no good."""

import json
import socket
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import zenoh
from pythonosc.osc_message import OscMessage
from pythonoscquery.osc_query_client import OSCQueryClient
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, ask, free_port, running, wait_for
from websockets.sync.client import ClientConnection
from zeroconf import ServiceInfo, Zeroconf

from haptic_server.gateway.oscquery.server import QUESTIONS_A_SECOND
from osc_bench import built
from oscquery_bench import connected_deaf, frame, get, listening, told
from protocol.messages import Readback, State, decode

DV = "/drumstick/param/dv_pls"
BOUND_S = 60.0


@pytest.fixture(scope="module")
def port() -> int:
    return free_port()


@pytest.fixture(scope="module")
def rig(port: int) -> Iterator[Rig]:
    with running("haptic", "--scene", "roll", "--oscquery", str(port)) as started:
        yield started


@pytest.fixture
def osc(rig: Rig) -> Iterator[Callable[..., None]]:
    """Sends an OSC message to the rig."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect(("127.0.0.1", rig.osc_in))
        yield lambda address, *args: udp.send(built(address, *args))


def received(listener: ClientConnection, address: str) -> list[object]:
    """The arguments of the next message to this address."""
    while True:
        packet = listener.recv(timeout=BOUND_S)
        assert isinstance(packet, bytes)
        message = OscMessage(packet)
        if message.address == address:
            return message.params


def test_value_follows_a_set_over_osc_and_listeners_hear_of_it(
    rig: Rig, session: zenoh.Session, port: int, osc: Callable[..., None]
) -> None:
    with listening(port, DV) as listener:
        wait_for("the first strikes", lambda: told(port, "/drumstick/strike?VALUE"))
        for value in (0.25, 0.1875):
            osc(DV, value)
            while received(listener, DV) != [
                value
            ]:  # what was in force when it began may be on its way still
                pass
            assert told(port, f"{DV}?VALUE") == {"VALUE": [value]}
    listed = json.loads(ask(session, rig.keys.doctor))["oscquery"]
    assert listed["200"] > 0
    assert listed["dropped"] == 0


def test_range_and_unit_are_those_of_the_wire(rig: Rig, session: zenoh.Session, port: int) -> None:
    contents = told(port, "/drumstick/param?CONTENTS")["CONTENTS"]
    scene = json.loads(ask(session, rig.keys.scene))
    assert set(contents) >= {"dv_pls", "k_coll", "z_h0"}
    assert scene["name"] == "roll"
    for name, node in contents.items():
        (limits,) = node["RANGE"]
        over = limits["MAX"] * 2.0
        with listening(port) as writer:
            writer.send(built(f"/drumstick/param/{name}", over))
            address, why = _error(writer)
        assert address == f"/drumstick/param/{name}"
        assert f"{limits['MAX']:g}" in why  # the refusal names the same limit


def _error(writer: ClientConnection) -> tuple[str, str]:
    address, why = received(writer, "/drumstick/error")
    return str(address), str(why)


def test_strikes_are_listened_to(rig: Rig, session: zenoh.Session, port: int) -> None:
    with listening(port, "/drumstick/strike", "/drumstick/gate") as listener:
        first = received(listener, "/drumstick/strike")
        second = received(listener, "/drumstick/strike")
        assert second[0] == first[0] + 1  # type: ignore[operator]
        assert received(listener, "/drumstick/gate") in ([0], [1])


def test_a_preset_and_a_lease_reach_a_listener(
    rig: Rig, session: zenoh.Session, port: int, osc: Callable[..., None]
) -> None:
    ask(session, rig.keys.preset_save, "evening")
    with listening(port, "/drumstick/preset", "/drumstick/lease") as listener:
        osc("/drumstick/preset/load", "evening")
        assert received(listener, "/drumstick/preset") == ["evening"]
        osc("/drumstick/lease", "Ada")
        name, left_s = received(listener, "/drumstick/lease")
        assert name == "Ada"
        assert 0.0 < float(str(left_s)) <= 5.0
        osc("/drumstick/lease", "")
        while received(listener, "/drumstick/lease") != ["", 0.0]:  # what was left is told again and again
            pass


def test_another_implementations_client_reads_it(rig: Rig, port: int) -> None:
    """python-oscquery: its nodes cannot have both a value and contents, so it is shown leaves."""
    kind = "_oscjson._tcp.local."
    service = ServiceInfo(kind, f"x.{kind}", port=port, parsed_addresses=["127.0.0.1"])
    client = OSCQueryClient(service)
    info = client.get_host_info()
    assert info is not None
    assert info.name == f"drumstick {rig.name}"
    assert (info.osc_ip, info.osc_port, info.osc_transport) == ("127.0.0.1", rig.osc_in, "UDP")
    node = client.query_node(f"{DV}/norm")
    assert node is not None
    assert node.full_path == f"{DV}/norm"
    assert node.access == 3
    wait_for("a strike", lambda: told(port, "/drumstick/level?VALUE"))
    level = client.query_node("/drumstick/level")
    assert level is not None
    assert level.access == 1
    assert client.query_node("/drumstick/nowhere") is None


def _sockets_of(rig: Rig) -> set[tuple[str, int]]:
    """(kind, port) of every socket that the gateway has bound."""
    pid = rig.children()["haptic_server.gateway"]
    inodes = set()
    for handle in Path(f"/proc/{pid}/fd").iterdir():
        try:
            name = handle.readlink().name
        except FileNotFoundError:
            continue
        if name.startswith("socket:["):
            inodes.add(name[8:-1])
    found = set()
    for kind in ("tcp", "udp", "tcp6", "udp6"):
        for line in Path(f"/proc/{pid}/net/{kind}").read_text().splitlines()[1:]:
            words = line.split()
            is_bound = kind.startswith("udp") or words[3] == "0A"  # LISTEN
            if words[9] in inodes and is_bound:
                found.add((kind, int(words[1].rpartition(":")[2], 16)))
    return found


@pytest.mark.long
def test_only_who_asks_gets_sockets(rig: Rig, session: zenoh.Session, port: int) -> None:
    usual = {("udp", rig.osc_in), ("tcp", rig.zenoh_port)}
    with running("haptic", "--scene", "roll") as plain:
        plain.client().close()
        assert _sockets_of(plain) == {("udp", plain.osc_in), ("tcp", plain.zenoh_port)}
    asked = _sockets_of(rig)
    assert usual | {("tcp", port)} < asked
    (inlet,) = asked - usual - {("tcp", port)}
    assert inlet[0] == "udp"
    assert inlet[1] != 5353  # nothing is announced on loopback
    with listening(port) as reader:
        assert reader.ping().wait(BOUND_S)
        assert len(_sockets_of(rig)) == len(asked)


def another_second() -> None:
    """Wait until what was asked before counts no more: questions are counted in whole seconds of this clock."""
    this = int(time.monotonic())
    wait_for("another second", lambda: int(time.monotonic()) > this)


def _steady(rig: Rig, session: zenoh.Session, disturb: Callable[[], None]) -> None:
    """The roll goes on, nothing is lost on its way, and parameters can be set, while `disturb` runs."""
    states = Listener(session, rig.keys.state, State)
    before = wait_for("a state", lambda: states.got[-1] if states.got else None)
    disturb()
    count = len(states.got)
    after = wait_for("a later state", lambda: states.got[-1] if len(states.got) > count else None)
    assert after.strikes > before.strikes
    assert after.ring_dropped == before.ring_dropped
    assert after.boot == before.boot
    another = 0.25 + 1e-3 * (after.revision % 97)  # a set that changes nothing makes no revision
    assert decode(ask(session, rig.keys.set_one("dv_pls"), another), Readback).revision > after.revision


@pytest.mark.long
def test_a_flood_of_requests_disturbs_nobody(rig: Rig, session: zenoh.Session, port: int) -> None:
    gateway = rig.children()["haptic_server.gateway"]

    def flood() -> None:
        questions = ("/", "/drumstick/strike?VALUE", "/drumstick?RANGE", "/?HOST_INFO")
        begun = time.monotonic()
        answers = Counter(get(port, questions[i % 4])[0] for i in range(2_000))
        assert answers.keys() <= {200, 503}
        # Whoever asks slower than the limit, on a busy machine, is refused nothing. A begun second counts at each end.
        assert 0 < answers[200] <= QUESTIONS_A_SECOND[0] * (time.monotonic() - begun + 2.0)

    _steady(rig, session, flood)
    assert rig.children()["haptic_server.gateway"] == gateway
    another_second()
    assert told(port, "/?HOST_INFO")


def test_hostile_guests_disturb_nobody(rig: Rig, session: zenoh.Session, port: int) -> None:
    gateway = rig.children()["haptic_server.gateway"]

    def has_room() -> bool:
        try:
            return get(port, "/")[0] == 200
        except ConnectionError:  # it still counts those that went
            return False

    def annoy() -> None:
        another_second()
        half_open = [socket.create_connection(("127.0.0.1", port)) for _ in range(80)]
        for each in half_open:
            each.close()
        wait_for("room for one more", has_room)
        assert get(port, "/" + "a" * 4000)[0] == 414
        assert get(port, "/../../etc/passwd")[0] == 404
        assert get(port, "/%2e%2e%2fetc")[0] == 404
        assert get(port, "/%ff%fe")[0] == 400
        assert get(port, "/", {"Host": "evil.example"})[0] == 421
        assert get(port, "/", {"Origin": "https://evil.example"})[0] == 403
        for garbage in (b"\x00\xff" * 500, b"GET /\xc3\x28 HTTP/1.1\r\n\r\n", b"G" * 200_000):
            with socket.create_connection(("127.0.0.1", port)) as there:
                try:
                    there.sendall(garbage)
                    there.shutdown(socket.SHUT_WR)
                    there.settimeout(BOUND_S)
                    while there.recv(65536):
                        pass
                except ConnectionError:
                    continue

    _steady(rig, session, annoy)
    assert rig.children()["haptic_server.gateway"] == gateway
    assert "Traceback" not in rig.said


@pytest.mark.long
def test_a_client_that_does_not_read_disturbs_nobody(
    rig: Rig, session: zenoh.Session, port: int, osc: Callable[..., None]
) -> None:
    another_second()
    with connected_deaf(port) as deaf, listening(port, DV) as listener:
        for path in (DV, "/drumstick/strike", "/drumstick/error"):
            deaf.sendall(frame(json.dumps({"COMMAND": "LISTEN", "DATA": path}).encode()))

        def flood() -> None:
            for i in range(5_000):
                osc(DV, 0.1 + (i % 100) / 1000.0)
                osc("/drumstick/nowhere", "x" * 200)

        _steady(rig, session, flood)
        assert received(listener, DV)


@pytest.mark.parametrize(
    ("given", "status", "words"),
    [
        (["--oscquery", "0"], 2, "a port being 1 .. 65535"),
        (["--oscquery", "x"], 2, "write [host:]port"),
        (["--oscquery", ":9102"], 2, "write [host:]port"),
        (["--oscquery", "no-such-host.invalid:9102"], 3, "no IPv4 address is known"),
        (["--oscquery-announce"], 2, "nothing to announce"),
    ],
)
@pytest.mark.long
def test_what_is_given_wrong_is_said(given: list[str], status: int, words: str) -> None:
    done = subprocess.run(
        [*DRUMSTICK, "haptic", *given], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == status
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.long
def test_a_taken_port_is_said() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = subprocess.run(
            [*DRUMSTICK, "haptic", "--oscquery", str(port), "--rig", f"oscquery-{port}"],
            capture_output=True, text=True, timeout=PATIENCE_S, check=False,
        )  # fmt: skip
    assert done.returncode == 3
    assert f"OSCQuery port 127.0.0.1:{port}" in done.stderr
    assert "--oscquery" in done.stderr


def _announced(kind: str, name: str) -> ServiceInfo:
    with Zeroconf(interfaces=["127.0.0.1"]) as look:
        return wait_for(name, lambda: look.get_service_info(kind, name))


@pytest.mark.long
def test_it_can_be_found_by_multicast_dns() -> None:
    port = free_port()
    with running("haptic", "--scene", "roll", "--oscquery", str(port), "--oscquery-announce") as rig:
        rig.client().close()
        for kind, expected in (("_oscjson._tcp.local.", port), ("_osc._udp.local.", rig.osc_in)):
            # The main thread has asyncio in it, where this worker has started a browser before.
            with ThreadPoolExecutor(1) as apart:
                info = apart.submit(_announced, kind, f"drumstick {rig.name}.{kind}").result()
            assert info.port == expected
            assert info.parsed_addresses() == ["127.0.0.1"]
        assert ("udp", 5353) in _sockets_of(rig)
        assert rig.stop() == 0
