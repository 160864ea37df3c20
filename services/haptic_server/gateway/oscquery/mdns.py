"""The rig's OSCQuery and OSC ports over multicast DNS, so that programs on the network find them by name.

zeroconf is imported, and its sockets are opened, only here. Its own threads answer; ours only starts and ends it,
because the check that a name is free takes a second.
"""

import logging
import threading
from typing import TYPE_CHECKING

from haptic_server.gateway.osc.targets import Endpoint
from protocol.endpoint import is_loopback

if TYPE_CHECKING:
    import zeroconf

OSCJSON, OSC = "_oscjson._tcp.local.", "_osc._udp.local."
_ANY = "0.0.0.0"
_JOIN_S = 2.0

_log = logging.getLogger("gateway")


def _own_addresses() -> list[str]:
    import ifaddr

    found = [str(ip.ip) for adapter in ifaddr.get_adapters() for ip in adapter.ips if ip.is_IPv4]
    return [address for address in found if not is_loopback(address)]


def services_of(
    rig: str, query: Endpoint, osc: Endpoint, own_addresses: list[str]
) -> "list[zeroconf.ServiceInfo]":
    """Services to announce: OSCQuery, and OSC unless only this machine can reach it while others can reach OSCQuery.

    `own_addresses` stand for an endpoint at 0.0.0.0.
    """
    import zeroconf

    found = [(OSCJSON, query)]
    if is_loopback(query[0]) or not is_loopback(osc[0]):
        found.append((OSC, osc))
    return [
        zeroconf.ServiceInfo(
            kind,
            f"drumstick {rig}.{kind}",
            port=endpoint[1],
            parsed_addresses=own_addresses if endpoint[0] == _ANY else [endpoint[0]],
        )
        for kind, endpoint in found
    ]


class Announcement:
    """Made, and upheld until `close`. The constructor raises ImportError when zeroconf is not installed; any thread."""

    def __init__(self, rig: str, query: Endpoint, osc: Endpoint) -> None:
        import zeroconf  # now, so that what is missing is said at the start

        self._zeroconf = zeroconf
        self._rig = rig
        self._query = query
        self._osc = osc
        self._stop = threading.Event()
        self.announced = threading.Event()  # when the names were found free, and are told
        self._thread = threading.Thread(target=self._run, name="announce", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Say good-bye and close the sockets; waits two seconds at most. Idempotent."""
        self._stop.set()
        self._thread.join(_JOIN_S)

    def _run(self) -> None:
        zeroconf = self._zeroconf
        host = self._query[0]
        try:
            made = zeroconf.Zeroconf(interfaces=zeroconf.InterfaceChoice.All if host == _ANY else [host])
        except OSError as error:
            _log.error("OSCQuery cannot be announced at %s: %s", host, error.strerror)
            return
        try:
            for service in services_of(self._rig, self._query, self._osc, _own_addresses()):
                made.register_service(service, allow_name_change=True)
                _log.info("announced: %s port %d", service.name, service.port)
            self.announced.set()
            self._stop.wait()
        except (zeroconf.Error, OSError) as error:
            _log.error("OSCQuery cannot be announced: %r", error)
        finally:
            made.close()
