"""A running rig as a command reaches it: endpoint, keys and certificate, from command line and rig file together."""

from pathlib import Path
from typing import NamedTuple

from protocol.access.identity import Identity
from protocol.endpoint import is_tls
from protocol.keys import DEFAULT_RIG, Keys
from rig import checks
from rig.identity import identity_check
from rig.identity.rig_file import RigFile, load

SETTERS = ("technician", "panel")
READERS = (*SETTERS, "listener")
FOLLOWERS = ("listener",)


class RemoteRig(NamedTuple):
    """A running rig as a command reaches it: the router's endpoint, its keys, and as whom we come in."""

    endpoint: str
    keys: Keys
    identity: Identity | None = None  # None on loopback


def remote_rig(
    rig_file: Path | None, rig: str | None, connect: str | None, *, roles: tuple[str, ...] = SETTERS
) -> RemoteRig:
    """Options of a command that talks to a running rig, with a certificate of one of these roles. Raises
    CommandError."""
    file = RigFile() if rig_file is None else load(rig_file)
    end = checks.endpoint(connect or file.connect)
    identity = None
    if is_tls(end):
        identity = identity_check.require_identity(end, file.identity)
        identity_check.warn(identity_check.require_client(identity, roles, "this command"))
    return RemoteRig(end, Keys(checks.rig_name(rig or file.name or DEFAULT_RIG)), identity)
