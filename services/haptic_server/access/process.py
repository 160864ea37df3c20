"""python -m haptic_server.access: a Zenoh router for other machines, over TLS, beside the gateway's own on loopback.

It admits certificates of the rig's authority, each with the rights of its role, and passes on what those permit. A
fault of Zenoh that somebody provokes from outside ends this process, not the gateway's; it is then started again. Main
thread.
"""

import argparse
import json
import signal
from functools import partial

from haptic_server.access.disconnection import Disconnector
from haptic_server.access.refusals import Refusals
from haptic_server.access.report import listener_report
from haptic_server.access.sockets import hold_silent
from protocol.access.identity import add_options, identity_of
from protocol.access.roles import ROLES, checked_roles
from protocol.endpoint import host_and_port
from protocol.keys import DEFAULT_ROUTER, Keys
from protocol.queryables import Queryables
from protocol.session import Public, open_access
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.stop import StopRequest

_TURN_S = 1.0


def _names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(",") if name)


def _arguments() -> tuple[str, Public]:
    parser = argparse.ArgumentParser(prog="haptic_server.access", description=__doc__)
    parser.add_argument("--connect", default=DEFAULT_ROUTER, help="the gateway's own router, on loopback")
    parser.add_argument("--public", required=True, help="where other machines come in: tls/...")
    parser.add_argument("--admit", type=_names, default=tuple(ROLES), help="roles that may come in")
    parser.add_argument("--carry", type=_names, required=True, help="rigs whose keys they may use")
    add_options(parser)
    given = parser.parse_args()
    try:
        identity = identity_of(given)
        if identity is None:
            raise ValueError("give --authority, --certificate and --private-key")
        return given.connect, Public(given.public, identity, given.carry, checked_roles(given.admit))
    except ValueError as error:
        parser.error(str(error))


def main() -> int:
    """Listen until a signal; the network and the gateway may come and go."""
    router, public = _arguments()
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    refusals = Refusals()
    refusals.follow_zenoh()
    with open_access(router, public) as session:
        import zenoh

        cutter = Disconnector(session)
        refusals.cut = cutter.cut
        _, port = host_and_port(public.endpoint)

        def answer(key: str, query: zenoh.Query) -> None:
            words = json.dumps(listener_report(session, public, refusals, cutter))
            query.reply(key, words, encoding=zenoh.Encoding.APPLICATION_JSON)
            query.drop()

        queryables = Queryables(session)
        for key in (Keys(rig).door for rig in public.rigs):
            queryables.declare_reading(key, partial(answer, key))
        supervisor = Supervisor()

        def publish() -> None:
            hold_silent(port)  # each time: Zenoh opens its listener when it can, and anew after a fault
            if supervisor.is_due:
                heard = (
                    "open"
                    if listener_report(session, public, refusals, cutter)["is_open"]
                    else "cannot be had, tried again"
                )
                supervisor.turned(f"{public.endpoint}: {heard}")

        publish()
        while not stop.wait(_TURN_S):
            publish()
        cutter.close()
        queryables.undeclare()
    return 0
