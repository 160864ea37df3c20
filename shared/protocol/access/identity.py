"""Identity of a process on the network: its certificate, its private key, and the authority that it trusts.

Only paths are handled here; Zenoh reads the files. Any thread.
"""

from pathlib import Path
from typing import NamedTuple


class Identity(NamedTuple):
    """Three PEM files."""

    authority: Path
    certificate: Path
    private_key: Path


def as_client(identity: Identity) -> dict[str, object]:
    """Zenoh's settings of a client that comes in with this certificate, and only to the host that it meant."""
    return _tls(
        root_ca_certificate=str(identity.authority),
        enable_mtls=True,
        connect_certificate=str(identity.certificate),
        connect_private_key=str(identity.private_key),
        verify_name_on_connect=True,
    )


def as_listener(identity: Identity) -> dict[str, object]:
    """Zenoh's settings of a listener that admits only certificates of the authority, for as long as they are valid."""
    return _tls(
        root_ca_certificate=str(identity.authority),
        enable_mtls=True,
        listen_certificate=str(identity.certificate),
        listen_private_key=str(identity.private_key),
        close_link_on_expiration=True,
    )


def _tls(**settings: object) -> dict[str, object]:
    return {f"transport/link/tls/{name}": value for name, value in settings.items()}
