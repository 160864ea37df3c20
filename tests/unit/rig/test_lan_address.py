"""Address of the page on the network: none unless it is asked for, and never all of them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig import checks, lan_address
from rig.exit_status import CommandError
from rig.identity.rig_file import RigFileError, parse


@pytest.fixture(autouse=True)
def on_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "own_address", lambda: "192.168.1.10")


def test_unless_asked_for_it_is_opened_nowhere() -> None:
    assert checks.panel_lan(None, None, None, 8080) is None


def test_the_command_line_closes_what_the_rig_file_opens() -> None:
    assert checks.panel_lan(False, None, ("10.0.0.5", 9000), 8080) is None
    with pytest.raises(CommandError, match="one or the other"):
        checks.panel_lan(False, "10.0.0.5", None, 8080)


@pytest.mark.parametrize(
    ("asked", "at", "file", "place"),
    [
        (True, None, None, ("192.168.1.10", 8443)),
        (None, "10.0.0.5", None, ("10.0.0.5", 8443)),
        (None, "10.0.0.5:9000", None, ("10.0.0.5", 9000)),
        (True, "9000", None, ("192.168.1.10", 9000)),
        (None, None, "auto", ("192.168.1.10", 8443)),
        (True, None, "10.0.0.5:9000", ("10.0.0.5", 9000)),
        (None, "10.0.0.6", "10.0.0.5:9000", ("10.0.0.6", 8443)),
    ],
)
def test_the_command_line_wins_over_the_rig_file(
    asked: bool | None, at: str | None, file: str | None, place: tuple[str, int]
) -> None:
    said = None if file is None else parse(f'[panel]\nlan = "{file}"\n', "rig.toml", Path("/")).panel_lan
    assert checks.panel_lan(asked, at, said, 8080) == place


@pytest.mark.parametrize(
    "words", ["0.0.0.0", "stage.local", "10.0.0.5:0", "10.0.0.5:x", "", ":9000", "224.0.0.1"]
)
def test_what_is_no_single_address_is_refused(words: str) -> None:
    with pytest.raises(CommandError, match="--panel-lan-at"):
        checks.panel_lan(True, words, None, 8080)
    with pytest.raises(RigFileError, match=r"panel\.lan"):
        parse(f'[panel]\nlan = "{words}"\n', "rig.toml", Path("/"))


def test_the_ports_of_both_pages_differ() -> None:
    with pytest.raises(CommandError, match="8443"):
        checks.panel_lan(True, None, None, 8443)


class Probe:
    """The socket by which the machine's own address is asked for; `own`: None without a route."""

    own: str | None = None

    def __init__(self, *_: object) -> None: ...
    def __enter__(self) -> "Probe":
        return self

    def __exit__(self, *_: object) -> None: ...
    def connect(self, _: object) -> None:
        if self.own is None:
            raise OSError("Network is unreachable")

    def getsockname(self) -> tuple[str, int]:
        return str(self.own), 1


@pytest.fixture
def probe(monkeypatch: pytest.MonkeyPatch) -> Iterator[type[Probe]]:
    monkeypatch.setattr(lan_address.socket, "socket", Probe)
    yield Probe
    Probe.own = None


def test_a_machine_on_the_open_internet_is_not_opened_by_chance(probe: type[Probe]) -> None:
    probe.own = "8.8.8.8"
    with pytest.raises(CommandError, match="whole internet"):
        lan_address.own_address()


@pytest.mark.parametrize("own", ["192.168.1.10", "100.64.0.7", "169.254.3.4"])
def test_what_the_internet_cannot_reach_is_taken(probe: type[Probe], own: str) -> None:
    """100.64/10 is the carriers' (RFC 6598): no private range, and behind their NAT."""
    probe.own = own
    assert lan_address.own_address() == own


def test_without_a_default_route_it_is_told_what_to_name(probe: type[Probe]) -> None:
    with pytest.raises(CommandError, match=r"no default route.*--panel-lan-at"):
        lan_address.own_address()
