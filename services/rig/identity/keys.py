"""`drumstick keys`: make the certificates of a rig, one folder for each machine to carry; show who they are for.

DIR/authority holds the key that makes all others: it stays where it was made. DIR/haptic, DIR/sound ... are complete:
authority, certificate, key, and a rig file that names them.
"""

from __future__ import annotations

import ipaddress
import json
import os
import re
import socket
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC, ROLES
from protocol.access.router import ROUTER
from protocol.keys import DEFAULT_RIG, checked_rig
from realtime.regular_file import read_bytes
from rig.exit_status import unavailable, usage_error
from rig.identity.rig_template import rig_file_text

if TYPE_CHECKING:
    from rig.identity.certificates import Pair

AUTHORITY = "authority"
CA_CERTIFICATE, CA_KEY, RIG_FILE, ROUTER_FILE = "ca.pem", "ca.key", "rig.toml", "router.json5"
_SERVERS = (HAPTIC, ROUTER)  # whose certificates name hosts
MAX_DAYS = 825  # about two years: what is stolen ends by itself
_ALWAYS = ("localhost", "127.0.0.1")  # the haptic machine to itself
_HOST_NAME = re.compile(
    r"(?=.{1,253}$)[A-Za-z0-9_]([A-Za-z0-9_-]{0,62})?(\.[A-Za-z0-9_]([A-Za-z0-9_-]{0,62})?)*"
)


def make(out: Path, rig: str | None, hosts: Sequence[str], days: int, routers: Sequence[str] = ()) -> None:
    """A new authority and a certificate for each role, valid `days`, in the folder `out`. Raises CommandError.

    `routers`: names and addresses of a router on a machine of its own, to which everybody then connects.
    """
    from rig.identity import certificates

    rig = _checked_rig(rig or DEFAULT_RIG)
    given = [_checked_host(host) for host in hosts] or [_checked_host(socket.gethostname())]
    between = [_checked_host(host, "--router") for host in routers]
    now = certificates.present()
    _new_folder(out)
    authority = certificates.new_authority(rig, now)
    put_pair(_subfolder(out, AUTHORITY), CA_KEY, CA_CERTIFICATE, authority)
    named = tuple(dict.fromkeys((*given, *_ALWAYS)))
    for role in (HAPTIC, *ROLES):
        folder = _subfolder(out, role)
        pair = certificates.new_pair(authority, role, named if role == HAPTIC else (), now, days)
        put_pair(folder, f"{role}.key", f"{role}.pem", pair)
        _put(folder / CA_CERTIFICATE, authority.certificate_pem)
        _put(folder / RIG_FILE, rig_file_text(role, rig, given[0], *between[:1]).encode())
    if between:
        pair = certificates.new_pair(authority, ROUTER, tuple(dict.fromkeys((*between, *_ALWAYS))), now, days)
        _put_router(_subfolder(out, ROUTER), authority, pair, rig)
    print(_made_words(out, named, between))


def _put_router(folder: Path, authority: Pair, pair: Pair, rig: str) -> None:
    from rig.identity.router_file import text, venue_router

    put_pair(folder, f"{ROUTER}.key", f"{ROUTER}.pem", pair)
    _put(folder / CA_CERTIFICATE, authority.certificate_pem)
    own = Identity(Path(CA_CERTIFICATE), Path(f"{ROUTER}.pem"), Path(f"{ROUTER}.key"))
    words = (f"The router of rig {rig}. Start it in this folder: zenohd -c {ROUTER_FILE}",)
    _put(folder / ROUTER_FILE, text(words, venue_router(own, [rig])).encode())


def renew(out: Path, role: str, hosts: Sequence[str], days: int) -> None:
    """A new certificate and key for one role, of the authority in `out`; the old ones are replaced. Raises
    CommandError."""
    from rig.identity import certificates

    if role not in (*_SERVERS, *ROLES):
        usage_error(f"--renew {role!r}: there is {', '.join((HAPTIC, *ROLES, ROUTER))}")
    given = [_checked_host(host) for host in hosts]
    if given and role not in _SERVERS:
        usage_error(
            f"--host is for the certificate of {HAPTIC}: only the haptic machine is connected to by name"
        )
    authority = _authority(out)
    now = certificates.present()
    left = certificates.days_left(authority.certificate, now)
    if left < days:
        usage_error(
            f"{out / AUTHORITY} ends in {left:.0f} days, before the {days} wanted: make new keys in another folder"
        )
    folder = out / role
    if not folder.is_dir():
        usage_error(f"{folder} is not there: `drumstick keys make --out {out}` makes it")
    if role in _SERVERS and not given:
        given = certificates.hosts_of(_read_certificate(folder / f"{role}.pem"))
    named = tuple(dict.fromkeys((*given, *_ALWAYS))) if role in _SERVERS else ()
    put_pair(folder, f"{role}.key", f"{role}.pem", certificates.new_pair(authority, role, named, now, days))
    print(f"{folder}: a new certificate for {days} days; carry {role}.pem and {role}.key, then restart there")


def show(folder: Path, as_json: bool) -> None:
    """Owner and end of each certificate below `folder`. Raises CommandError when there is none."""
    from rig.identity import certificates

    now = certificates.present()
    paths = sorted(folder.rglob("*.pem")) if folder.is_dir() else []
    if not paths:
        usage_error(f"{folder}: no certificates there; `drumstick keys make --out DIR` makes some")
    rows = [_row(path, now) for path in paths]
    if as_json:
        print(json.dumps({"certificates": rows}))
        return
    for row in rows:
        left = row["days_left"]
        when = f"until {row['until']} ({left} days)" if left >= 0 else f"ENDED {row['until']}"
        hosts = f", as {', '.join(row['hosts'])}" if row["hosts"] else ""
        print(f"{row['file']}: {row['name']}, {when}{hosts}")


def _row(path: Path, now: datetime) -> dict[str, Any]:
    from rig.identity import certificates

    certificate = _read_certificate(path)
    return {
        "file": str(path),
        "name": certificates.name_of(certificate),
        "until": certificate.not_valid_after_utc.date().isoformat(),
        "days_left": int(certificates.days_left(certificate, now) // 1),
        "hosts": certificates.hosts_of(certificate),
    }


def _made_words(out: Path, hosts: Sequence[str], routers: Sequence[str]) -> str:
    return "\n".join(
        (
            f"{out / AUTHORITY}: the authority. Keep it at home: who has its key can be anybody.",
            f"{out / HAPTIC}: for the haptic machine, reached as {', '.join(hosts)}",
            *(f"{out / name}: for {role.words}" for name, role in ROLES.items()),
            *([f"{out / ROUTER}: for the router, reached as {', '.join(routers)}"] if routers else []),
            f"On each machine: drumstick ... --rig-file FOLDER/{RIG_FILE}",
        )
    )


def _checked_rig(rig: str) -> str:
    try:
        return checked_rig(rig)
    except ValueError as error:
        usage_error(f"--rig: {error}")


def _checked_host(host: str, option: str = "--host") -> str:
    try:
        return str(ipaddress.ip_address(host))
    except ValueError:
        if not _HOST_NAME.fullmatch(host):
            usage_error(f"{option} {host!r}: give a name or an address by which others reach that machine")
    return host


def _new_folder(out: Path) -> None:
    try:
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            usage_error(
                f"--out {out}: something is there, and keys are never overwritten; name a new folder, or use --renew"
            )
        out.mkdir(mode=0o700, parents=True, exist_ok=True)
        out.chmod(0o700)
    except OSError as error:
        unavailable(f"{out} cannot be made: {error.strerror}")


def _subfolder(out: Path, name: str) -> Path:
    try:
        (out / name).mkdir(mode=0o700)
    except OSError as error:
        unavailable(f"{out / name} cannot be made: {error.strerror}")
    return out / name


def put_pair(folder: Path, key: str, certificate: str, pair: Pair) -> None:
    """Write a key and its certificate, for their owner only. Raises CommandError."""
    _put(folder / key, pair.key_pem)
    _put(folder / certificate, pair.certificate_pem)


def _put(path: Path, content: bytes) -> None:
    # Never open to others, not even for a moment; and whole, or not there.
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
            file.write(content)
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        unavailable(f"{path} cannot be written: {error.strerror}")


def _read(path: Path) -> bytes:
    from rig.identity import certificates

    try:
        return read_bytes(path, certificates.MAX_PEM)
    except OSError as error:
        usage_error(f"{path}: cannot be read: {error.strerror}")


def _read_certificate(path: Path):
    from rig.identity import certificates

    try:
        return certificates.read_certificate(_read(path))
    except ValueError as error:
        usage_error(f"{path}: no certificate in PEM form: {error}")


def _authority(out: Path) -> Pair:
    from rig.identity import certificates

    place = out / AUTHORITY
    certificate = _read_certificate(place / CA_CERTIFICATE)
    try:
        key = certificates.read_key(_read(place / CA_KEY))
    except ValueError as error:
        usage_error(f"{place / CA_KEY}: {error}")
    if not certificates.belongs(key, certificate):
        usage_error(f"{place}: {CA_KEY} is not the key of {CA_CERTIFICATE}")
    return certificates.Pair(key, certificate)
