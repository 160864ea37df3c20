"""`--port auto`: where another program has a port, a free one is used and told; what is free is kept."""

import dataclasses
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

import ports
from rig.exit_status import CommandError
from rig.network.ports import free_port, require_free_udp
from rig.supervision.parts import HAPTIC, PANEL
from rig.supervision.plan import Options
from rig.supervision.rig_options import with_free_ports

HOST = "127.0.0.1"


@pytest.fixture
def held() -> Iterator[tuple[int, int]]:
    """A UDP port and a TCP port that somebody has."""
    with socket.socket(type=socket.SOCK_DGRAM) as udp, socket.socket() as tcp:
        udp.bind((HOST, ports.free_port()))
        tcp.bind((HOST, ports.free_port()))
        tcp.listen()
        yield udp.getsockname()[1], tcp.getsockname()[1]


def options(tmp_path: Path, udp: int, tcp: int, **changes: object) -> Options:
    asked = Options(
        "test", tmp_path, tmp_path, frozenset({HAPTIC, PANEL}),
        listen=f"tcp/{HOST}:{tcp}", osc_bind=(HOST, udp), panel_port=tcp,
    )  # fmt: skip
    return dataclasses.replace(asked, **changes)


def test_what_is_taken_becomes_free_and_is_told(
    held: tuple[int, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    udp, tcp = held
    found = with_free_ports(options(tmp_path, udp, tcp))
    assert found.osc_bind[0] == HOST
    assert found.osc_bind[1] != udp
    assert tcp not in (found.panel_port, int(found.listen.rpartition(":")[2]))
    assert found.listen.startswith(f"tcp/{HOST}:")
    require_free_udp(*found.osc_bind, "OSC port", "--osc-in")
    said = capsys.readouterr().err
    assert f"incoming OSC: port {udp} is taken; using {found.osc_bind[1]}" in said
    assert f"the page: port {tcp} is taken; using {found.panel_port}" in said
    assert f"port {tcp} is taken; using {found.listen.rpartition(':')[2]}" in said


def test_the_page_and_zenoh_get_ports_of_their_own(held: tuple[int, int], tmp_path: Path) -> None:
    found = with_free_ports(options(tmp_path, *held))
    assert int(found.listen.rpartition(":")[2]) != found.panel_port


def test_incoming_osc_is_not_where_the_strikes_go(held: tuple[int, int], tmp_path: Path) -> None:
    udp, tcp = held
    found = with_free_ports(options(tmp_path, udp, tcp, osc_targets=(f"{HOST}:{udp + 1}",)))
    assert found.osc_bind[1] not in (udp, udp + 1)


def test_what_is_free_is_kept_without_a_word(
    held: tuple[int, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    udp, tcp = (
        free_port(kind, HOST, port)
        for kind, port in zip((socket.SOCK_DGRAM, socket.SOCK_STREAM), held, strict=True)
    )
    asked = options(tmp_path, udp, tcp, panel_port=free_port(socket.SOCK_STREAM, HOST, tcp + 1))
    assert with_free_ports(asked) == asked
    assert capsys.readouterr().err == ""


def test_an_address_of_another_machine_is_an_error(held: tuple[int, int], tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=r"192\.0\.2\.1"):
        with_free_ports(options(tmp_path, *held, osc_bind=("192.0.2.1", held[0])))
