"""Addresses of targets given by name. One that nobody knows yet, on a network that comes up late, holds up nothing."""

import logging
import socket
import threading
from collections.abc import Callable, Sequence

from haptic_server.gateway.osc.targets import Endpoint

_AGAIN_S = 2.0
_log = logging.getLogger("osc")


def numeric(endpoint: tuple[str, int], flags: int = 0) -> Endpoint:
    """Its IPv4 address; OSError when nobody knows one. May block for many seconds, unless it is a number already."""
    found = socket.getaddrinfo(*endpoint, socket.AF_INET, socket.SOCK_DGRAM, flags=flags)
    return str(found[0][4][0]), int(found[0][4][1])


def split(targets: Sequence[tuple[str, int]]) -> tuple[list[Endpoint], list[tuple[str, int]]]:
    """Separate numeric targets from those given by name. Does not block."""
    known: list[Endpoint] = []
    names: list[tuple[str, int]] = []
    for target in targets:
        try:
            known.append(numeric(target, socket.AI_NUMERICHOST))
        except OSError:
            names.append(target)
    return known, names


def find(
    names: Sequence[tuple[str, int]], found: Callable[[Endpoint], None], closing: threading.Event
) -> None:
    """Ask for each name until it is known, in a thread of its own; nobody waits for that thread.

    `found` is called in it, once for each name; `closing` ends it. What is not known is said once.
    """

    def ask() -> None:
        left, is_first = list(names), True
        while left and not closing.is_set():
            unknown: list[tuple[str, int]] = []
            for host, port in left:
                try:
                    address = numeric((host, port))
                except (OSError, UnicodeError) as error:
                    unknown.append((host, port))
                    if is_first:
                        _log.warning(
                            "%s:%d gets no OSC yet, its name cannot be resolved: %s; trying again",
                            host,
                            port,
                            error,
                        )
                    continue
                found(address)
                if not is_first:
                    _log.info("%s:%d is %s, and gets OSC now", host, port, address[0])
            left, is_first = unknown, False
            if left:
                closing.wait(_AGAIN_S)

    if names:
        threading.Thread(target=ask, name="names", daemon=True).start()
