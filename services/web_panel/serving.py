"""Guard, page, Zenoh and wishes, joined and run."""

import sys
import time
from collections.abc import Callable

from protocol.identity import Identity
from web_panel.admission import Admission
from web_panel.client_message import ClientMessages
from web_panel.guard import GuardError as GuardError
from web_panel.guard import start
from web_panel.mirror import Mirror
from web_panel.page import Page
from web_panel.pointer_door import PointerDoor
from web_panel.rig_link import RigLink
from web_panel.shelf import Doors
from web_panel.wishes import Wishes

_PERIOD_S = 1.0 / 15.0


def serve(
    rig: str,
    endpoint: str,
    port: int,
    token: str,
    keep_on: Callable[[], bool],
    identity: Identity | None = None,
) -> None:
    """Serve until `keep_on` says no; prints the address when it can be visited. Raises GuardError. Main thread."""
    messages, mirror = ClientMessages(), Mirror()
    link = RigLink(rig, endpoint, mirror, identity)
    server = start(Admission(token, port), messages, PointerDoor(link.point))
    wishes = Wishes(link.set_one)
    try:
        page = Page(server, messages, wishes, link.panic, Doors(link.load_preset, link.save_preset), rig)
        link.start()
        wishes.start()
        page.show(mirror, time.monotonic())
        print(f"panel: http://127.0.0.1:{port}/?token={token}", file=sys.stderr, flush=True)
        while keep_on():
            time.sleep(_PERIOD_S)
            link.poll(time.monotonic())
            while not wishes.answers.empty():
                name, value, answer = wishes.answers.get()
                if answer.readback is not None:
                    mirror.note_readback(name, answer.readback)
                    link.check_again()
                page.note_answer(name, value, answer)
            page.show(mirror, time.monotonic())
    finally:
        wishes.close()
        link.close()
        server.stop()
