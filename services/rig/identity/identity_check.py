"""Check of this machine's certificate for what it is to do, before anything starts.

Raises CommandError: status 2 for what stays wrong, 3 for what a renewed certificate or a clock that is set will mend.
"""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC, ROLES
from realtime.log import say
from realtime.regular_file import read_bytes
from rig.exit_status import unavailable, usage_error

if TYPE_CHECKING:
    from cryptography import x509

WARN_DAYS = 30.0


def require_listener(identity: Identity) -> list[str]:
    """Fit for the public listener; warnings, each a line."""
    from rig.identity import certificates

    certificate, warnings = _require(identity)
    if not certificates.hosts_of(certificate) or certificates.name_of(certificate) != HAPTIC:
        usage_error(
            f"{identity.certificate}: is of {certificates.name_of(certificate)!r}; the public listener needs the one of"
            f" {HAPTIC!r}, which names the hosts that others connect to"
        )
    return warnings


def require_client(identity: Identity, roles: Sequence[str], what: str) -> list[str]:
    """Fit for `what`, which needs one of `roles`; warnings, each a line."""
    from rig.identity import certificates

    certificate, warnings = _require(identity)
    name = certificates.name_of(certificate)
    if name not in roles:
        known = "" if name in (HAPTIC, *ROLES) else ", which is no role"
        usage_error(
            f"{identity.certificate}: is of {name!r}{known}; {what} needs the certificate of {' or '.join(roles)}"
        )
    return warnings


def require_identity(endpoint: str, identity: Identity | None) -> Identity:
    """The identity that this machine shows at an endpoint over TLS."""
    if identity is None:
        usage_error(
            f"{endpoint}: over TLS this machine must show a certificate: give --rig-file with [keys] (docs/security.md)"
        )
    return identity


def warn(warnings: list[str]) -> None:
    """Say them on stderr."""
    for words in warnings:
        say(logging.WARNING, f"drumstick: {words}")


def _require(identity: Identity) -> tuple[x509.Certificate, list[str]]:
    from rig.identity import certificates

    _require_private(identity.private_key)
    authority = _certificate(identity.authority)
    certificate = _certificate(identity.certificate)
    try:
        key = certificates.read_key(_read(identity.private_key))
    except ValueError as error:
        usage_error(f"{identity.private_key}: no private key that can be used: {error}")
    if not certificates.belongs(key, certificate):
        usage_error(
            f"{identity.private_key}: is not the key of {identity.certificate}; carry the two together"
        )
    if not certificates.is_of(certificate, authority):
        usage_error(
            f"{identity.certificate}: was not made by {identity.authority}; take both from one `keys make`"
        )
    warnings = [_ended(identity.authority, authority), _ended(identity.certificate, certificate)]
    return certificate, [words for words in warnings if words]


def _ended(path: Path, certificate: x509.Certificate) -> str:
    # Words when it ends soon; Stop when it is not valid now.
    from rig.identity import certificates

    now = certificates.present()
    left = certificates.days_left(certificate, now)
    if left <= 0.0:
        unavailable(f"{path}: ended {certificate.not_valid_after_utc:%Y-%m-%d %H:%M} UTC; {_renewal(path)}")
    if certificate.not_valid_before_utc > now:
        unavailable(
            f"{path}: is valid only from {certificate.not_valid_before_utc:%Y-%m-%d %H:%M} UTC:"
            " set this machine's clock"
        )
    return f"{path} ends in {left:.0f} days; {_renewal(path)}" if left < WARN_DAYS else ""


def _renewal(path: Path) -> str:
    return f"renew it where the authority is: drumstick keys make --out DIR --renew {path.stem}"


def _require_private(path: Path) -> None:
    try:
        found = path.stat()
    except OSError as error:
        usage_error(f"{path}: cannot be read: {error.strerror}")
    if not stat.S_ISREG(found.st_mode):
        usage_error(f"{path}: is no file")
    if found.st_uid not in (os.geteuid(), 0):
        usage_error(f"{path}: belongs to another user (uid {found.st_uid}); a private key must be yours")
    if found.st_mode & 0o077:
        usage_error(
            f"{path}: may be read by others (mode {found.st_mode & 0o777:o}, at most 600); type: chmod 600 {path}"
        )


def _read(path: Path) -> bytes:
    from rig.identity import certificates

    try:
        return read_bytes(path, certificates.MAX_PEM)
    except OSError as error:
        usage_error(f"{path}: cannot be read: {error.strerror}")


def _certificate(path: Path) -> x509.Certificate:
    from rig.identity import certificates

    try:
        return certificates.read_certificate(_read(path))
    except ValueError as error:
        usage_error(f"{path}: no certificate in PEM form: {error}")
