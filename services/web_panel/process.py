"""`python -m web_panel`: serve the technician's page of one rig on 127.0.0.1 until told to stop.

Exit status 0 stopped, 1 a fault of ours (viser is not as the guard knows it), 2 a wrong argument, 3 the machine lacks
something (port taken, viser not installed).
"""

import logging
import signal

from realtime.garbage import importing
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.regular_file import read_text
from realtime.service_options import options_of_process
from web_panel.access.lan_admission import LanAdmission
from web_panel.access.lan_listener import Lan, LimitedListener, fingerprint_of, tls_of
from web_panel.access.one_time_login import OneTimeLogin
from web_panel.access.port import free_port
from web_panel.access.visitor_token import TokenFileError, token_of
from web_panel.options import LanOptions, PanelOptions

CHANGES = "panel-changes.json"  # beside the token: undo, A and B
_MAX_PEM = 100_000  # bytes; ours have some hundred
_log = logging.getLogger("panel")


def _end(status: int, words: str) -> int:
    _log.error("panel: %s", words)
    return status


def _lan(given: LanOptions, token: str) -> Lan:
    admission = LanAdmission(token, given.port, host=given.host, login=OneTimeLogin())
    return Lan(
        admission,
        LimitedListener(given.host, given.port),
        tls_of(given.certificate, given.private_key),
        fingerprint_of(read_text(given.certificate, _MAX_PEM)),
    )


def main() -> int:
    """Run until SIGTERM or SIGINT; the exit status."""
    stopped: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda signum, frame: stopped.append(signum))
    given = options_of_process(PanelOptions, "web_panel")
    open_log()
    logging.getLogger().setLevel(logging.WARNING)  # each browser that comes is news to viser's libraries
    _log.setLevel(logging.INFO)
    try:
        token, port = token_of(given.token_file), free_port(given.port)
    except TokenFileError as error:
        return _end(2, str(error))
    except (OSError, OverflowError) as error:
        return _end(3, f"port {given.port} of 127.0.0.1 is not free: {error}")
    try:
        lan = None if given.lan is None else _lan(given.lan, token)
    except (OSError, ValueError) as error:
        return _end(3, f"the page cannot be opened to the network (--panel-lan): {error}")
    try:
        with importing():
            from web_panel.accuracy_results import Files
            from web_panel.serving import Addresses, ViserIncompatible, serve
            from web_panel.tuning.undo_file import UndoFile
    except ImportError as error:
        return _end(3, f"{error}; install haptic-drumstick[panel]")
    supervisor = Supervisor()

    def keep_on() -> bool:
        # Asked at each turn of the page's loop, the first time when it can be visited.
        supervisor.notify_alive(f"the page of rig {given.rig} at port {port} of this machine")
        return not stopped

    try:
        files = Files(given.accuracy_shipped, given.accuracy_own)
        kept = UndoFile(given.token_file.with_name(CHANGES))
        addresses = Addresses(port, token, lan, given.lan is not None and given.lan.in_terminal)
        serve(given.rig, given.connect, addresses, kept, keep_on, given.identity, files)
    except ViserIncompatible as error:
        return _end(1, str(error))
    return 0
