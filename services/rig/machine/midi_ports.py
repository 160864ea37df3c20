"""`--midi-out list`, `--midi-in list`: which MIDI ports there are.

The library is asked in a process of its own, which it may end.
"""

import json
import subprocess
import sys

from haptic_server.gateway.midi.options import MidiOptions
from realtime.service_options import command
from rig.exit_status import unavailable

_ANSWER_WITHIN_S = 20.0


def show(as_json: bool, listens: bool) -> None:
    """Print the ports that can be heard, or those that can be played, one a line.

    CommandError when the library does not answer.
    """
    asked = command("haptic_server.gateway.midi", MidiOptions(client="drumstick list", listens=listens))
    try:
        done = subprocess.run(asked, capture_output=True, text=True, timeout=_ANSWER_WITHIN_S, check=False)
    except subprocess.TimeoutExpired:
        unavailable(f"the MIDI system does not answer within {_ANSWER_WITHIN_S:.0f} s")
    if done.returncode != 0:
        unavailable(
            f"the MIDI library ended with status {done.returncode}: {done.stdout.strip() or 'no word'}"
        )
    ports: list[str] = json.loads(done.stdout)["ports"]
    if as_json:
        print(json.dumps({"ports": ports}))
    elif ports:
        print("\n".join(ports))
    else:
        print("no MIDI port is there; `virtual` makes one where a MIDI system runs", file=sys.stderr)
