"""Command-line values, checked with one clear line each. Raises CommandError with status 2."""

import math
import socket
from pathlib import Path

from protocol.keys import DEFAULT_ROUTER, Keys, checked_rig
from protocol.osc import DEFAULT_OUT, checked_prefix
from rig import extras
from rig.exit_status import unavailable, usage_error
from rig.lan_address import AUTO, DEFAULT_PORT, checked_place, own_address

DEFAULT_TARGET = "{}:{}".format(*DEFAULT_OUT)


def rig_name(name: str) -> str:
    """A name that can stand in a Zenoh key."""
    try:
        checked_rig(name)
    except ValueError as error:
        usage_error(str(error))
    return name


def endpoint(connect: str | None, option: str = "--connect") -> str:
    """The Zenoh endpoint, or the default one."""
    from protocol.endpoint import host_and_port

    try:
        host_and_port(connect or DEFAULT_ROUTER)
    except ValueError as error:
        usage_error(f"{option}: {error}")
    return connect or DEFAULT_ROUTER


def wire(rig: str, connect: str | None) -> tuple[str, Keys]:
    """Endpoint and keys of a running rig."""
    rig_name(rig)
    return endpoint(connect), Keys(rig)


def port(number: int, option: str) -> None:
    """A port number."""
    if not 1 <= number <= 65535:
        usage_error(f"{option} {number}: a port is 1 .. 65535")


def target(text: str, option: str = "--osc-out") -> str:
    """host:port of an OSC listener, whose name nobody needs to know yet."""
    host, _, number = text.rpartition(":")
    if not host or not number.isdecimal() or not 1 <= int(number) <= 65535:
        usage_error(f"{option} {text!r}: write host:port, e.g. {DEFAULT_TARGET}")
    return text


def known_target(text: str, option: str = "--osc-out") -> str:
    """Like `target`, for one that is sent to at once."""
    host, _, number = target(text, option).rpartition(":")
    try:
        socket.getaddrinfo(host, int(number), socket.AF_INET, socket.SOCK_DGRAM)
    except (OSError, UnicodeError):
        unavailable(
            f"{option} {text!r}: no IPv4 address is known for {host!r}; write one, e.g. {DEFAULT_TARGET}"
        )
    return text


def oscquery(text: str | None, announce: bool) -> tuple[str, int] | None:
    """Host and port to serve OSCQuery at, when asked for; the packages that this takes are there."""
    if text is None:
        if announce:
            usage_error("--oscquery-announce: there is nothing to announce without --oscquery [HOST:]PORT")
        return None
    host, colon, number = text.rpartition(":")
    host = host if colon else "127.0.0.1"
    if not host or not number.isdecimal() or not 1 <= int(number) <= 65535:
        usage_error(
            f"--oscquery {text!r}: write [host:]port, a port being 1 .. 65535, e.g. 9102 or 192.168.1.5:9102"
        )
    try:
        found = socket.getaddrinfo(host, int(number), socket.AF_INET, socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        unavailable(
            f"--oscquery {text!r}: no IPv4 address is known for {host!r}; write one, e.g. 127.0.0.1:9102"
        )
    extras.require("--oscquery", "oscquery")
    return str(found[0][4][0]), int(number)


def panel_lan(
    asked: bool | None, at: str | None, file: tuple[str, int | None] | None, page_port: int
) -> tuple[str, int] | None:
    """Address and port at which the page is opened to the network; None where nobody asks for it, and where it is
    refused (`asked` False) whatever the rig file says."""
    if asked is False:
        if at is not None:
            usage_error("--no-panel-lan and --panel-lan-at: one or the other")
        return None
    try:
        place = (AUTO, None) if asked and file is None else file
        place = place if at is None else checked_place(at)
    except ValueError as error:
        usage_error(f"--panel-lan-at {error}")
    if place is None:
        return None
    number = place[1] or DEFAULT_PORT
    if number == page_port:
        usage_error(f"--panel-lan-at: {number} is the page's port on 127.0.0.1 (--panel-port): take another")
    return own_address() if place[0] == AUTO else place[0], number


def prefix(text: str) -> None:
    """First part of OSC addresses."""
    try:
        checked_prefix(text)
    except ValueError as error:
        usage_error(f"--prefix: {error}")


def finite(value: float, option: str, low: float, high: float, unit: str) -> None:
    """A finite number within limits."""
    if not (math.isfinite(value) and low <= value <= high):
        usage_error(f"{option} {value}: must be {low:g} .. {high:g} {unit}")


def duration(seconds: float | None) -> None:
    """A duration, if given."""
    if seconds is not None:
        finite(seconds, "--duration", 0.0, 1e7, "s")


def _installed_device(words: str) -> None:
    from drumstick.packages import DEVICES, PackageError, entry_of

    try:
        if entry_of(DEVICES, words) is None:
            known = "simulated, pointer, openhaptics, replay:FILE, or the name of one in an installed package"
            usage_error(f"--device {words}: there is {known}")
    except PackageError as error:
        unavailable(f"--device {words}: {error}")


def device(words: str) -> None:
    """A device that the servo knows or an installed package has; a recording that is there."""
    kind, _, path = words.partition(":")
    if words in ("simulated", "pointer", "openhaptics"):
        return
    if kind != "replay" or not path:
        _installed_device(words)
        return
    if not Path(path).is_file():
        usage_error(f"--device {words}: there is no file {path}")
