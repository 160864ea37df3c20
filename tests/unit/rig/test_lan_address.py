"""Address of the page on the network: none unless it is asked for, and never all of them."""

from pathlib import Path

import pytest

from rig import checks, lan_address
from rig.exit_status import CommandError
from rig.identity.rig_file import RigFileError, parse


@pytest.fixture(autouse=True)
def on_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checks, "own_address", lambda: "192.168.1.10")


def test_unless_asked_for_it_is_opened_nowhere() -> None:
    assert checks.panel_lan(False, None, None, 8080) is None


@pytest.mark.parametrize(
    ("asked", "at", "file", "place"),
    [
        (True, None, None, ("192.168.1.10", 8443)),
        (False, "10.0.0.5", None, ("10.0.0.5", 8443)),
        (False, "10.0.0.5:9000", None, ("10.0.0.5", 9000)),
        (True, "9000", None, ("192.168.1.10", 9000)),
        (False, None, "auto", ("192.168.1.10", 8443)),
        (True, None, "10.0.0.5:9000", ("10.0.0.5", 9000)),
        (False, "10.0.0.6", "10.0.0.5:9000", ("10.0.0.6", 8443)),
    ],
)
def test_the_command_line_wins_over_the_rig_file(
    asked: bool, at: str | None, file: str | None, place: tuple[str, int]
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


def test_a_machine_on_the_open_internet_is_not_opened_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    class Probe:
        def __init__(self, *_: object) -> None: ...
        def __enter__(self) -> "Probe":
            return self

        def __exit__(self, *_: object) -> None: ...
        def connect(self, _: object) -> None: ...
        def getsockname(self) -> tuple[str, int]:
            return "8.8.8.8", 1

    monkeypatch.setattr(lan_address.socket, "socket", Probe)
    with pytest.raises(CommandError, match="whole internet"):
        lan_address.own_address()
