"""A running rig as a command reaches it: from command line and rig file, as one of the roles that the command needs."""

from pathlib import Path

import pytest

from made_keys import Keyring, rig_file
from protocol.keys import DEFAULT_ROUTER
from rig.exit_status import CommandError
from rig.network.remote_rig import FOLLOWERS, READERS, remote_rig


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Keyring:
    return Keyring(tmp_path_factory.mktemp("k"))


def test_commands_for_a_running_rig(tmp_path: Path, ring: Keyring) -> None:
    assert remote_rig(None, None, None)[0] == DEFAULT_ROUTER
    endpoint, keys, identity = remote_rig(rig_file(tmp_path, ring, "technician"), None, None)
    assert (endpoint, keys.rig) == ("tls/haptic.local:7448", "stage")
    assert identity is not None
    on_the_haptic_machine = remote_rig(rig_file(tmp_path, ring, "haptic"), None, None)
    assert on_the_haptic_machine[0] == DEFAULT_ROUTER
    assert on_the_haptic_machine[2] is None


def test_the_certificate_must_fit_the_command(tmp_path: Path, ring: Keyring) -> None:
    path = rig_file(tmp_path, ring, "listener")
    with pytest.raises(CommandError, match="this command needs the certificate of technician or panel"):
        remote_rig(path, None, None)
    assert remote_rig(path, None, None, roles=READERS)[2] is not None


def test_tls_without_a_certificate_is_told_at_once() -> None:
    with pytest.raises(CommandError, match="must show a certificate"):
        remote_rig(None, None, "tls/haptic.local:7448")


def test_only_who_may_follow_the_play_can_record_it(tmp_path: Path, ring: Keyring) -> None:
    for role in ("technician", "panel"):
        with pytest.raises(CommandError, match="listener"):
            remote_rig(rig_file(tmp_path, ring, role), None, None, roles=FOLLOWERS)
    assert remote_rig(rig_file(tmp_path, ring, "listener"), None, None, roles=FOLLOWERS).identity is not None
