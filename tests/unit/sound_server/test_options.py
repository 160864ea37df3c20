"""The command line of the sound server: a restart for a lost device is who it was before."""

import sys
from pathlib import Path

import pytest

from protocol.access.identity import Identity
from sound_server import options

IDENTITY = Identity(Path("ca.pem"), Path("sound.pem"), Path("sound.key"))


def read(monkeypatch: pytest.MonkeyPatch, *words: str):
    monkeypatch.setattr(sys, "argv", ["sound_server", *words])
    return options.read()


def test_a_restart_keeps_rigs_router_and_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    given = read(
        monkeypatch,
        "--rig",
        "a,b",
        "--connect",
        "tls/haptic.local:7448",
        "--block",
        "64",
        *IDENTITY.options(),
    )
    assert given.identity == IDENTITY
    again = read(monkeypatch, *options.again(given, "null")[3:])
    assert (again.rigs, again.connect, again.block) == (("a", "b"), "tls/haptic.local:7448", 64)
    assert (again.audio, again.awaited, again.identity) == ("null", True, IDENTITY)


def test_without_a_certificate_there_is_none_after_a_restart_either(monkeypatch: pytest.MonkeyPatch) -> None:
    given = read(monkeypatch)
    assert given.identity is None
    assert "--certificate" not in options.again(given, "null")


def test_a_part_of_a_certificate_is_a_mistake(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        read(monkeypatch, "--certificate", "sound.pem")
    assert ended.value.code == 2
    assert "give all of --authority, --certificate, --private-key, or none" in capsys.readouterr().err
