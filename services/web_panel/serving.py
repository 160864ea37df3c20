"""Guard, page, Zenoh, changes, lease and prediction, joined and run."""

import gc
import logging
import time
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from protocol.access.identity import Identity
from web_panel.access.admission import Admission
from web_panel.access.client_message import ClientMessages
from web_panel.access.lan_listener import Lan
from web_panel.access.lease_access import LeaseAccess
from web_panel.access.pointer_access import PATH as POINTER_PATH
from web_panel.access.pointer_access import PointerAccess
from web_panel.access.strike_access import PATH as STRIKE_PATH
from web_panel.access.strike_access import StrikeAccess
from web_panel.access.viser_access import ViserIncompatible as ViserIncompatible
from web_panel.access.viser_access import start
from web_panel.accuracy_results import NO_FILES, Files
from web_panel.computing.computer import Computer
from web_panel.controls.preset_panel import PresetActions
from web_panel.page import qr_code
from web_panel.rig.answer import Answer
from web_panel.rig.rig_link import RigLink
from web_panel.rig.rig_state import RigState
from web_panel.stage.stage_frame import NEEDS as STAGE_NEEDS
from web_panel.stage.stage_frame import stage_frame
from web_panel.stage.stage_page import PATH as STAGE_PATH
from web_panel.stage.stage_page import stage_page
from web_panel.stage.stage_socket import PATH as STAGE_STATE_PATH
from web_panel.stage.stage_socket import StageSocket
from web_panel.tuning.changes import Changes
from web_panel.tuning.prediction import Prediction
from web_panel.tuning.undo_file import UndoFile
from web_panel.views.view_choice import Sources
from web_panel.whole_page import Page, RigActions

_log = logging.getLogger("panel")
_PICTURE_S = 1.0 / 30.0
_TURNS_A_PAGE = 2  # pictures for each time that the rest is written
_ALONE_S = (
    0.5  # nobody looks: the panel only keeps up with the rig, and the page is written when somebody comes
)


class Addresses(NamedTuple):
    """Addresses of the page: on 127.0.0.1 with a token, and on the network where `lan` says so."""

    port: int
    token: str
    lan: Lan | None = None
    in_terminal: bool = False  # a camera may look at the log


def _say_address(addresses: Addresses) -> None:
    _log.info("panel: http://127.0.0.1:%d/?token=%s", addresses.port, addresses.token)
    _log.info(
        "panel: for a second screen: http://127.0.0.1:%d%s?token=%s",
        addresses.port,
        STAGE_PATH,
        addresses.token,
    )
    if addresses.lan is None:
        return
    addresses.lan.admission.login.renew()
    link = addresses.lan.admission.open_link
    _log.info("panel: %s", addresses.lan.words)
    _log.info(
        "panel: admits one browser, once, within 10 minutes; a new link by Phone on this machine's page: %s",
        link,
    )
    if addresses.in_terminal:
        for line in qr_code.terminal_lines(link):
            _log.info("%s", line)


def serve(
    rig: str,
    endpoint: str,
    addresses: Addresses,
    kept: UndoFile,
    keep_on: Callable[[], bool],
    identity: Identity | None = None,
    accuracy: Files = NO_FILES,
) -> None:
    """Serve until `keep_on` says no; logs the address when it can be visited. Raises ViserIncompatible. Main thread."""
    messages, rig_state = ClientMessages(), RigState()
    link = RigLink(rig, endpoint, rig_state, identity)
    lease = LeaseAccess(link.take_lease)
    stage = StageSocket()
    sockets = {
        POINTER_PATH: PointerAccess(link.point).serve,
        STRIKE_PATH: StrikeAccess(link.play, link.choke).serve,
        STAGE_STATE_PATH: stage.serve,
    }
    own_pages = {STAGE_PATH: stage_page(rig)}
    server = start(Admission(addresses.token, addresses.port), messages, sockets, addresses.lan, own_pages)
    # Two, so that nobody who drags waits for a plot's second of theory; each starts its process when first asked.
    for_prediction, for_plots = Computer(), Computer()
    prediction = Prediction(for_prediction)
    changes = Changes(link.set, link.load_preset, lease.secret_of, prediction.ask, kept)

    def load_scene(name: str, client: int | None) -> Answer:
        return link.load_scene(name, lease.secret_of(client))

    def rename_preset(name: str, new: str, client: int | None) -> Answer:
        return link.rename_preset(name, new, lease.secret_of(client))

    def delete_preset(name: str, client: int | None) -> Answer:
        return link.delete_preset(name, lease.secret_of(client))

    try:
        presets = PresetActions(changes.load, link.save_preset, rename_preset, delete_preset)
        page = Page(
            server,
            messages,
            changes,
            RigActions(link.panic, presets, load_scene),
            lease,
            prediction,
            Sources(for_plots, accuracy),
            rig,
        )
        if addresses.lan is not None:
            page.add_phones(addresses.lan)
        link.start()
        changes.start()
        lease.start()
        page.show(rig_state, time.monotonic())
        _say_address(addresses)
        # What is there now lives as long as the panel. Not looked through any more, it holds up no collection of what
        # each browser leaves behind: else those wait until there is a quarter as much of it.
        gc.freeze()
        turn = 0
        while keep_on():
            seen, on_stage = page.views.follow(), stage.watched
            time.sleep(_PICTURE_S if seen or on_stage else _ALONE_S)
            link.watch(page.views.needs | STAGE_NEEDS if on_stage else page.views.needs)
            link.poll(time.monotonic())
            if on_stage:
                stage.show(msgspec.json.encode(stage_frame(rig_state, rig, time.monotonic())))
            for request, answer in changes.take_answers(rig_state, time.monotonic()):
                if answer.taken:
                    link.check_again()
                ((name, value),) = request.values.items()
                page.note_answer(name, value, answer)
            if not seen:
                rig_state.forget_news()
                continue
            page.show_picture(rig_state, time.monotonic())
            turn += 1
            if turn % _TURNS_A_PAGE == 0:
                page.show(rig_state, time.monotonic())
    finally:
        for_prediction.close()
        for_plots.close()
        changes.close()
        lease.close()
        link.close()
        server.stop()
