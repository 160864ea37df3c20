"""Identity of a process on the network: its certificate, its private key, and the authority that it trusts.

Only paths are handled here; Zenoh reads the files. Any thread.
"""

import argparse
from pathlib import Path
from typing import NamedTuple


class Identity(NamedTuple):
    """Three PEM files."""

    authority: Path
    certificate: Path
    private_key: Path

    def options(self) -> list[str]:
        """Arguments that `add_options` reads, for the command line of a service."""
        named = zip(_OPTIONS, self, strict=True)
        return [word for option, path in named for word in (option, str(path))]


_OPTIONS = ("--authority", "--certificate", "--private-key")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give a service's command line the options that `identity_of` reads."""
    for option, words in zip(_OPTIONS, ("whose certificates are trusted", "our own", "its key"), strict=True):
        parser.add_argument(option, type=Path, metavar="FILE", help=f"PEM: {words}; for tls/ endpoints")


def identity_of(given: argparse.Namespace) -> Identity | None:
    """The identity that was given, or None; ValueError when only a part of it was."""
    paths: list[Path | None] = [given.authority, given.certificate, given.private_key]
    there = [path for path in paths if path is not None]
    if not there:
        return None
    if len(there) < len(paths):
        raise ValueError(f"give all of {', '.join(_OPTIONS)}, or none")
    return Identity(*there)


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
