"""python -m haptic_server.access: a Zenoh router for other machines, over TLS, beside the gateway's own on loopback.

It admits certificates of the rig's authority, each with the rights of its role, and passes on what those permit. A
fault of Zenoh that somebody provokes from outside ends this process, not the gateway's; it is then started again. Main
thread.
"""

import json
import signal
from functools import partial

from haptic_server.access.disconnection import Disconnector
from haptic_server.access.options import AccessOptions
from haptic_server.access.refusals import Refusals
from haptic_server.access.report import listener_report
from haptic_server.access.sockets import hold_silent
from protocol.endpoint import host_and_port
from protocol.keys import Keys
from protocol.queryables import Queryables
from protocol.session import open_access
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.service_options import options_of_process
from realtime.stop import StopRequest

_TURN_S = 1.0


def main() -> int:
    """Listen until a signal; the network and the gateway may come and go."""
    given = options_of_process(AccessOptions, "haptic_server.access")
    router, public = given.connect, given.public
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    refusals = Refusals()
    refusals.follow_zenoh()
    with open_access(router, public) as session:
        import zenoh

        disconnector = Disconnector(session)
        refusals.cut = disconnector.cut
        _, port = host_and_port(public.endpoint)

        def answer(key: str, query: zenoh.Query) -> None:
            words = json.dumps(listener_report(session, public, refusals, disconnector))
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
                    if listener_report(session, public, refusals, disconnector)["is_open"]
                    else "cannot be had, tried again"
                )
                supervisor.notify_alive(f"{public.endpoint}: {heard}")

        publish()
        while not stop.wait(_TURN_S):
            publish()
        disconnector.close()
        queryables.undeclare()
    return 0
