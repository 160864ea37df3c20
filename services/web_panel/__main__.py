"""`python -m web_panel`: serve the technician's page of one rig on 127.0.0.1 until told to stop.

Exit status 0 stopped, 1 a fault of ours (viser is not as the guard knows it), 2 a wrong argument, 3 the machine lacks
something (port taken, viser not installed).
"""

import argparse
import signal
import socket
import sys
import time
from pathlib import Path

from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig
from web_panel.visitor_token import TokenFileError, token_of


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="web_panel", description="The technician's page.")
    parser.add_argument("--rig", type=checked_rig, default=DEFAULT_RIG)
    parser.add_argument("--connect", default=DEFAULT_ROUTER, metavar="ENDPOINT", help="the Zenoh router")
    parser.add_argument("--port", type=int, default=8080, help="0: any free port")
    parser.add_argument("--token-file", type=Path, required=True, metavar="FILE", help="made when missing")
    return parser.parse_args()


def _free_port(wanted: int) -> int:
    # viser would silently take the next one.
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", wanted))
        return probe.getsockname()[1]


def main() -> int:
    """Run until SIGTERM or SIGINT; the exit status."""
    given = _arguments()
    try:
        token = token_of(given.token_file)
        port = _free_port(given.port)
    except TokenFileError as error:
        print(f"panel: {error}", file=sys.stderr)
        return 2
    except (OSError, OverflowError) as error:
        print(f"panel: port {given.port} of 127.0.0.1 is not free: {error}", file=sys.stderr)
        return 3
    try:
        from web_panel.serving import GuardError, serve
    except ImportError as error:
        print(f"panel: {error}; install haptic-drumstick[panel]", file=sys.stderr)
        return 3
    stopping = False

    def stop(signum: int, frame: object) -> None:
        nonlocal stopping
        stopping = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    try:
        serve(given.rig, given.connect, port, token, lambda: not stopping, time.monotonic)
    except GuardError as error:
        print(f"panel: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
