"""python -m drumstick_lab.soak.processes.companion WHAT ...: a process beside a soaking rig. Stopped, it prints its counts as JSON."""

import argparse
import json
import signal
import sys
from pathlib import Path

from drumstick_lab.soak.listeners import count_osc, count_zenoh
from drumstick_lab.soak.processes.visitor import Visitor, Where
from realtime.stop import StopRequest

OSC, ZENOH, VISITOR = "osc", "zenoh", "visitor"


def main() -> int:
    """Run until SIGTERM."""
    parser = argparse.ArgumentParser(prog="drumstick_lab.soak.processes.companion", description=__doc__)
    parser.add_argument("what", choices=(OSC, ZENOH, VISITOR))
    parser.add_argument("--rig", required=True)
    parser.add_argument("--connect", required=True)
    parser.add_argument("--osc-in", type=int, required=True)
    parser.add_argument("--osc-out", type=int, required=True)
    parser.add_argument("--panel-port", type=int, required=True)
    parser.add_argument("--token-file", type=Path, required=True)
    parser.add_argument("--parameter", required=True)
    parser.add_argument("--pause", type=float, required=True, help="between visits, s")
    parser.add_argument("--hurry", type=float, required=True, help="so long without pauses at first, s")
    given = parser.parse_args()
    stop = StopRequest()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop.ask)
    if given.what == OSC:
        counts = count_osc(given.osc_out, stop)
    elif given.what == ZENOH:
        counts = count_zenoh(given.connect, given.rig, stop)
    else:
        where = Where(given.rig, given.connect, given.osc_in, given.panel_port, given.token_file)
        counts = Visitor(where, given.parameter).run(stop, given.pause, given.hurry)
    print(json.dumps(counts), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
