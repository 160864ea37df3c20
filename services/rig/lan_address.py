"""The address at which the page is opened to the network (--panel-lan, [panel] of a rig file)."""

import ipaddress
import socket

from rig.exit_status import unavailable

DEFAULT_PORT = 8443
AUTO = "auto"  # the address by which this machine reaches its network


def checked_place(text: str) -> tuple[str, int | None]:
    """Address, or AUTO, and port of `[ADDRESS:]PORT`, `ADDRESS` or `auto`; None for a port that is not given. Raises
    ValueError."""
    host, colon, number = text.rpartition(":")
    if not colon:
        host, number = (AUTO, text) if text.isdecimal() else (text, "")
    if host != AUTO:
        try:
            address = ipaddress.IPv4Address(host)
        except ValueError:
            raise ValueError(f"{text!r}: write [address:]port, e.g. 192.168.1.10:8443 or 8443") from None
        if address.is_unspecified or address.is_multicast:
            raise ValueError(f"{text!r}: name one address of this machine, e.g. 192.168.1.10")
    if not number and not colon:
        return host, None
    if not number.isdecimal() or not 1 <= int(number) <= 65535:
        raise ValueError(f"{text!r}: a port is 1 .. 65535")
    return host, int(number)


def own_address() -> str:
    """IPv4 address by which this machine reaches its network. Raises CommandError without one, and for a public one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing; the system picks the address
            own = str(probe.getsockname()[0])
        except OSError:
            unavailable(
                "--panel-lan: this machine has no default route, by which its address on the network is found;"
                " name the address, e.g. --panel-lan-at 192.168.1.10"
            )
    if ipaddress.ip_address(own).is_global:
        unavailable(
            f"--panel-lan: {own} can be reached from the whole internet: if you mean that, say --panel-lan-at {own}"
        )
    return own
