"""A rig file: who this machine's rig is on the network, and who may speak to it. TOML; every mistake at once.

Without one, everything stays on loopback. Paths are relative to the file.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

from drumstick.parameters.declare import text
from drumstick.scenes.reading import Reader, shown, tables_of
from protocol.access.identity import Identity
from protocol.access.roles import ROLES, checked_roles
from protocol.endpoint import host_and_port, is_loopback, is_tls
from protocol.keys import checked_rig
from realtime.regular_file import read_text
from rig.exit_status import usage_error
from rig.lan_address import checked_place

MAX_BYTES = 100_000
_MAX_ITEMS = 64
_MAX_TEXT = 400
_WIDEST_BITS = 8
_T = TypeVar("_T")


@dataclass(frozen=True)
class Zenoh:
    """Endpoints at which other machines come in, or to which this one goes."""

    public: str = text("", "endpoint at which other machines come in, e.g. tls/0.0.0.0:7448")
    connect: str = text("", "endpoint of the haptic machine's public listener, e.g. tls/haptic.local:7448")


@dataclass(frozen=True)
class Keys:
    """This machine's PEM files."""

    authority: str = text("", "certificate of the authority")
    certificate: str = text("", "this machine's certificate")
    private_key: str = text("", "its key, readable only for its owner")


@dataclass(frozen=True)
class Osc:
    """Address at which OSC is received, sources and targets."""

    bind: str = text("", "host:port")


@dataclass(frozen=True)
class Panel:
    """The technician's page."""

    lan: str = text(
        "", "auto, or address:port: where phones on the network reach the page, as by --panel-lan"
    )


class RigFile(NamedTuple):
    """Contents of a rig file; None where it says nothing."""

    name: str | None = None
    public: str | None = None
    connect: str | None = None
    roles: tuple[str, ...] = tuple(ROLES)
    also: tuple[str, ...] = ()
    identity: Identity | None = None
    osc_bind: tuple[str, int] | None = None
    osc_targets: tuple[str, ...] | None = None
    osc_allow: tuple[str, ...] | None = None
    panel_lan: tuple[str, int | None] | None = None


class RigFileError(ValueError):
    """Mistakes in a rig file, one line each."""

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("\n".join(mistakes))
        self.mistakes = mistakes


def load(path: Path) -> RigFile:
    """Read and check a rig file; the files it names are not opened. Raises CommandError with every mistake."""
    try:
        return parse(read_text(path, MAX_BYTES), str(path), path.absolute().parent)
    except UnicodeDecodeError as error:
        usage_error(f"--rig-file {path}: not UTF-8 text (byte {error.start}); save it as UTF-8")
    except OSError as error:
        usage_error(f"--rig-file {path}: cannot be read: {error.strerror}")
    except RigFileError as error:
        usage_error(str(error))


def parse(text: str, source: str, folder: Path) -> RigFile:
    """Read a rig file's text; `source` names it in messages, `folder` holds its keys. Raises RigFileError."""
    try:
        given = tables_of(text)
    except ValueError as error:
        raise RigFileError([f"{source}: not valid TOML: {error}"]) from None
    reader = Reader(source, text)
    values: dict[str, Any] = {}
    for key, value in given.items():
        if key == "name":
            values["name"] = _checked(reader, key, value, checked_rig)
        elif key == "zenoh":
            values |= _zenoh(reader, value)
        elif key == "keys":
            values["identity"] = _identity(reader, value, folder)
        elif key == "osc":
            values |= _osc(reader, value)
        elif key == "panel":
            table = reader.values("panel", Panel, value)
            if "lan" in table:
                values["panel_lan"] = _checked(reader, "panel.lan", table["lan"], checked_place)
        else:
            reader.refuse(key, "unknown key; known here: name, zenoh, keys, osc, panel")
    found = RigFile(**values)
    _check_whole(reader, found, given)
    if reader.mistakes:
        raise RigFileError(reader.mistakes)
    return found


def _check_whole(reader: Reader, found: RigFile, given: dict[str, Any]) -> None:
    if found.public and found.connect:
        reader.refuse(
            "zenoh.connect", "a machine has a public listener or connects to one: leave one of them out"
        )
    for key, endpoint in (("public", found.public), ("connect", found.connect)):
        if endpoint is not None and is_tls(endpoint) and "keys" not in given:
            reader.refuse(f"zenoh.{key}", "tls/ needs [keys]: authority, certificate, private_key")
    if found.osc_bind is not None and not is_loopback(found.osc_bind[0]) and found.osc_allow is None:
        reader.refuse(
            "osc.bind",
            'is open to the network, but nobody is allowed: name them, e.g. allow = ["192.168.1.20/32"]',
        )


def _zenoh(reader: Reader, given: object) -> dict[str, Any]:
    table = reader.values("zenoh", Zenoh, given, also_known=("roles", "also"))
    values: dict[str, Any] = {
        key: _checked(reader, f"zenoh.{key}", table[key], check)
        for key, check in (("public", _public), ("connect", _connect))
        if key in table
    }
    for key, check in (("roles", _role), ("also", checked_rig)):
        items = _listed(reader, f"zenoh.{key}", given, key, check)
        if items is not None:
            values[key] = items
    return values


def _public(endpoint: str) -> str:
    host_and_port(endpoint)
    if not is_tls(endpoint):
        raise ValueError(f"{endpoint!r}: other machines come in over TLS only, e.g. tls/0.0.0.0:7448")
    return endpoint


def _connect(endpoint: str) -> str:
    host, _ = host_and_port(endpoint)
    if not is_tls(endpoint) and not is_loopback(host):
        raise ValueError(
            f"{endpoint!r}: another machine is reached over TLS only, e.g. tls/haptic.local:7448"
        )
    return endpoint


def _role(name: str) -> str:
    return checked_roles([name])[0]


def _identity(reader: Reader, given: object, folder: Path) -> Identity | None:
    table = reader.values("keys", Keys, given)
    refused = len(reader.mistakes)
    for key in ("authority", "certificate", "private_key"):
        if isinstance(given, dict) and key not in given:
            reader.refuse(
                f"keys.{key}", "missing: the three of authority, certificate and private_key belong together"
            )
        elif table.get(key) == "":
            reader.refuse(f"keys.{key}", "'' must name a PEM file")
    if len(reader.mistakes) > refused or len(table) < 3:
        return None
    return Identity(*(folder / table[key] for key in ("authority", "certificate", "private_key")))


def _osc(reader: Reader, given: object) -> dict[str, Any]:
    table = reader.values("osc", Osc, given, also_known=("targets", "allow"))
    values: dict[str, Any] = {}
    if "bind" in table:
        values["osc_bind"] = _checked(reader, "osc.bind", table["bind"], _bound)
    for key, check in (("targets", _target), ("allow", _network)):
        items = _listed(reader, f"osc.{key}", given, key, check)
        if items is not None:
            values[f"osc_{key}"] = items
    return values


def _target(address: str) -> str:
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise ValueError(f"{address!r} must be host:port with a port of 1 .. 65535, e.g. 192.168.1.20:9101")
    return address


def _bound(address: str) -> tuple[str, int]:
    host, _, port = _target(address).rpartition(":")
    return host, int(port)


def _network(words: str) -> str:
    try:
        network = ipaddress.IPv4Network(words)
    except ValueError as error:
        raise ValueError(f"{words!r} must be an IPv4 network like 192.168.1.0/24: {error}") from None
    if network.prefixlen < _WIDEST_BITS:
        raise ValueError(f"{words!r} is nearly everybody: /{_WIDEST_BITS} is the widest that is allowed")
    return str(network)


def _checked(reader: Reader, path: str, value: object, check: Callable[[str], _T]) -> _T | None:
    if not isinstance(value, str) or len(value) > _MAX_TEXT:
        reader.refuse(path, f"{shown(value)} must be text in quotes, at most {_MAX_TEXT} characters")
        return None
    try:
        return check(value)
    except ValueError as error:
        reader.refuse(path, str(error))
        return None


def _listed(
    reader: Reader, path: str, table: object, key: str, check: Callable[[str], str]
) -> tuple[str, ...] | None:
    # None when it is not given. An empty list says: nobody.
    if not isinstance(table, dict) or key not in table:
        return None
    value = cast(dict[str, object], table)[key]
    items = cast(list[object], value) if isinstance(value, list) else None
    if items is None or len(items) > _MAX_ITEMS:
        reader.refuse(
            path, f"{shown(cast(object, value))} must be a list of at most {_MAX_ITEMS} texts in quotes"
        )
        return None
    checked = [_checked(reader, path, item, check) for item in items]
    return tuple(dict.fromkeys(item for item in checked if item is not None))
