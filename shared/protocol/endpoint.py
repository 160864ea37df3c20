"""Zenoh endpoints as text: protocol/host:port. Any thread."""

import ipaddress

_PROTOCOLS = ("tcp", "tls")


def host_and_port(endpoint: str) -> tuple[str, int]:
    """127.0.0.1, 7447 of tcp/127.0.0.1:7447; ValueError for anything else."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in _PROTOCOLS or not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise ValueError(f"{endpoint!r} is not a Zenoh endpoint like tcp/127.0.0.1:7447")
    return host.removeprefix("[").removesuffix("]"), int(port)


def is_tls(endpoint: str) -> bool:
    """True when the other end is known by its certificate."""
    return endpoint.startswith("tls/")


def is_loopback(host: str) -> bool:
    """True when only this machine's own processes can be there. Of names only `localhost` counts."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_every_address(host: str) -> bool:
    """True when a socket bound there listens on every address of the machine."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False
