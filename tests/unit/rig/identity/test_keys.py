"""`drumstick keys`: what it makes, what it refuses, and what a start with those keys says."""

import json
import stat
from datetime import timedelta
from pathlib import Path

import pytest

from made_keys import Keyring
from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC, ROLES
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.identity import certificates, identity_check, keys
from rig.identity.rig_file import load


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("a") / "keys"
    keys.make(out, "stage", ["haptic.local", "192.168.1.10"], 90)
    return out


def certificate(path: Path):
    return certificates.read_certificate(path.read_bytes())


def test_each_machine_gets_a_folder_that_is_whole_and_fit(made: Path) -> None:
    assert sorted(p.name for p in made.iterdir()) == sorted(["authority", HAPTIC, *ROLES])
    for role in (HAPTIC, *ROLES):
        file = load(made / role / "rig.toml")
        assert file.name == "stage"
        assert file.identity is not None
        if role == HAPTIC:
            assert identity_check.require_listener(file.identity) == []
        else:
            assert file.connect == "tls/haptic.local:7448"
            assert identity_check.require_client(file.identity, (role,), "it") == []
    assert not list(made.glob("*/ca.key"))[1:]  # the authority's key is in one place only


def test_who_may_open_them(made: Path) -> None:
    for path in (made, *made.rglob("*")):
        mode = stat.S_IMODE(path.stat().st_mode)
        assert mode == (0o700 if path.is_dir() else 0o600), path


def test_what_the_certificates_say(made: Path) -> None:
    authority = certificate(made / "authority" / "ca.pem")
    now = certificates.present()
    for role in (HAPTIC, *ROLES):
        found = certificate(made / role / f"{role}.pem")
        assert certificates.name_of(found) == role
        assert certificates.is_of(found, authority)
        assert 89.9 < certificates.days_left(found, now) <= 90.0
        hosts = ["haptic.local", "192.168.1.10", "localhost", "127.0.0.1"]
        assert certificates.hosts_of(found) == (hosts if role == HAPTIC else [])


def test_keys_are_never_overwritten(made: Path, tmp_path: Path) -> None:
    before = {p: p.read_bytes() for p in made.rglob("*") if p.is_file()}
    with pytest.raises(CommandError, match="keys are never overwritten") as stop:
        keys.make(made, None, ["x"], 10)
    assert stop.value.status == GIVEN
    assert {p: p.read_bytes() for p in made.rglob("*") if p.is_file()} == before
    (tmp_path / "file").touch()
    with pytest.raises(CommandError, match="something is there"):
        keys.make(tmp_path / "file", None, ["x"], 10)
    with pytest.raises(CommandError, match="cannot be made") as stop:
        keys.make(tmp_path / "file" / "below", None, ["x"], 10)
    assert stop.value.status == LACKING


@pytest.mark.parametrize("host", ["", "a b", "x/y", "-a", "a" * 300, "tls/haptic:7448", "192.168.1.10:7448"])
def test_a_host_that_is_none(tmp_path: Path, host: str) -> None:
    with pytest.raises(CommandError, match="give a name or an address") as stop:
        keys.make(tmp_path / "k", None, [host], 10)
    assert stop.value.status == GIVEN
    assert not (tmp_path / "k").exists()


def test_one_role_is_renewed_by_the_same_authority(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "k"
    keys.make(out, "stage", ["haptic.local"], 10)
    before = {p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()}
    keys.renew(out, "sound", [], 100)
    keys.renew(out, HAPTIC, [], 100)
    after = {p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()}
    changed = {str(p) for p in after if after[p] != before.get(p)}
    assert changed == {"sound/sound.pem", "sound/sound.key", "haptic/haptic.pem", "haptic/haptic.key"}
    assert certificates.hosts_of(certificate(out / "haptic" / "haptic.pem")) == [
        "haptic.local",
        "localhost",
        "127.0.0.1",
    ]
    sound = load(out / "sound" / "rig.toml").identity
    assert sound is not None
    assert identity_check.require_client(sound, ("sound",), "it") == []
    keys.renew(out, HAPTIC, ["10.0.0.1"], 100)
    assert certificates.hosts_of(certificate(out / "haptic" / "haptic.pem"))[0] == "10.0.0.1"
    assert "carry sound.pem and sound.key" in capsys.readouterr().out


def test_a_renewal_that_cannot_be(tmp_path: Path, made: Path) -> None:
    with pytest.raises(CommandError, match="--renew 'drummer': there is haptic, sound"):
        keys.renew(made, "drummer", [], 10)
    with pytest.raises(CommandError, match="only the haptic machine is connected to by name"):
        keys.renew(made, "sound", ["x"], 10)
    with pytest.raises(CommandError, match="cannot be read"):
        keys.renew(tmp_path, "sound", [], 10)
    with pytest.raises(CommandError, match="before the 5000 wanted"):
        keys.renew(made, "sound", [], 5000)


def test_show_tells_who_and_until_when(
    made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    capsys.readouterr()
    keys.show(made / "sound", as_json=False)
    said = capsys.readouterr().out
    assert "sound.pem: sound, until " in said
    assert "(89 days)" in said
    keys.show(made, as_json=True)
    told = json.loads(capsys.readouterr().out)["certificates"]
    assert {row["name"] for row in told} >= {HAPTIC, *ROLES}
    old = Keyring(tmp_path / "old").ended("panel")
    keys.show(tmp_path / "old", as_json=False)
    assert f"{old.certificate}: panel, ENDED " in capsys.readouterr().out
    with pytest.raises(CommandError, match="no certificates there"):
        keys.show(tmp_path / "nowhere", as_json=False)


class TestAtAStart:
    """Words about keys before anything starts."""

    def refused(self, identity: Identity, status: int = GIVEN) -> str:
        with pytest.raises(CommandError) as stop:
            identity_check.require_client(identity, ("sound",), "drumstick sound")
        assert stop.value.status == status
        return str(stop.value)

    def test_an_end_that_is_near_is_told(self, tmp_path: Path) -> None:
        ring = Keyring(tmp_path / "k")
        (words,) = identity_check.require_client(ring.identity("sound", days=29.5), ("sound",), "it")
        assert "ends in 2" in words or "ends in 30" in words
        assert "--renew" in words
        assert identity_check.require_client(ring.identity("sound", days=31.0), ("sound",), "it") == []

    def test_the_wrong_certificates(self, tmp_path: Path) -> None:
        ring, foreign = Keyring(tmp_path / "k"), Keyring(tmp_path / "f")
        good = ring.identity("sound")
        assert "is of 'panel'; drumstick sound needs the certificate of sound" in self.refused(
            ring.identity("panel")
        )
        assert "is of 'x', which is no role" in self.refused(ring.identity("x"))
        assert "ended " in self.refused(ring.ended("sound"), LACKING)
        later = ring.identity("sound", begun=certificates.present() + timedelta(days=1))
        assert "set this machine's clock" in self.refused(later, LACKING)
        assert "was not made by" in self.refused(good._replace(authority=foreign.authority))
        other = ring.identity("sound")
        assert "is not the key of" in self.refused(good._replace(private_key=other.private_key))
        with pytest.raises(CommandError, match="the public listener needs the one of 'haptic'"):
            identity_check.require_listener(good)
        with pytest.raises(CommandError, match="which names the hosts"):
            identity_check.require_listener(ring.identity(HAPTIC))

    def test_files_that_are_not_as_they_must_be(self, tmp_path: Path) -> None:
        good = Keyring(tmp_path / "k").identity("sound")
        gone = tmp_path / "gone"
        for part in ("authority", "certificate", "private_key"):
            assert "cannot be read: No such file" in self.refused(good._replace(**{part: gone}))
        assert "is no file" in self.refused(good._replace(private_key=tmp_path))
        gone.write_text("nothing")
        gone.chmod(0o600)
        assert "no certificate in PEM form" in self.refused(good._replace(certificate=gone))
        assert "no private key that can be used" in self.refused(good._replace(private_key=gone))
        for mode in (0o640, 0o604, 0o660, 0o644):
            good.private_key.chmod(mode)
            said = self.refused(good)
            assert f"may be read by others (mode {mode:o}, at most 600)" in said
            assert f"chmod 600 {good.private_key}" in said


def test_with_a_router_everybody_connects_there_and_it_has_a_folder_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "keys"
    keys.make(out, "stage", ["haptic.local"], 90, ["router.local", "10.0.0.5"])
    assert f"{out / 'router'}: for the router, reached as router.local, 10.0.0.5" in capsys.readouterr().out
    for role in (HAPTIC, *ROLES):
        file = load(out / role / "rig.toml")
        assert (file.public, file.connect) == (None, "tls/router.local:7448")
    found = certificate(out / "router" / "router.pem")
    assert certificates.name_of(found) == "router"
    assert certificates.hosts_of(found) == ["router.local", "10.0.0.5", "localhost", "127.0.0.1"]
    text = (out / "router" / "router.json5").read_text()
    assert '"drumstick/stage/strike"' in text
    assert '"router.key"' in text
    keys.renew(out, "router", [], 30)
    assert certificates.hosts_of(certificate(out / "router" / "router.pem"))[:2] == [
        "router.local",
        "10.0.0.5",
    ]


def test_a_router_of_an_impossible_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CommandError) as stop:
        keys.make(tmp_path / "keys", None, [], 90, ["no name"])
    assert stop.value.status == GIVEN
    assert "--router 'no name'" in str(stop.value)
