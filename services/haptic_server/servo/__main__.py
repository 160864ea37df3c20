"""python -m haptic_server.servo: owns the device, runs the tick until SIGTERM. No sockets."""

import argparse
import json
import logging
import os
import signal
import sys
import threading
from pathlib import Path

from drumstick import envelope
from drumstick.law import law_of
from drumstick.parameters import Refusal
from drumstick.scene import parse
from haptic_server import block, files
from haptic_server.limits import limits_of, specification_of
from haptic_server.records import FAULT_WORDS
from haptic_server.servo import loop, memory, priority, trace
from haptic_server.servo.latch import fits
from realtime.atomics import poke

_log = logging.getLogger("servo")
_LOOK_EVERY_S = 0.25


def _tell_granted(path: Path, granted: dict[str, str]) -> None:
    try:
        path.write_text(json.dumps(granted), encoding="utf-8")
    except OSError as error:  # only `doctor` reads it: no reason not to play
        _log.warning("%s cannot be written: %s", path, error.strerror)


def _watch(servo: memory.Servo, path: Path) -> None:
    # Until a signal: when a fault is latched, its last thousand ticks go to a file.
    written = False
    while signal.sigtimedwait({signal.SIGTERM, signal.SIGINT}, _LOOK_EVERY_S) is None:
        player = servo.player[0]
        if not player["trace_ended"]:
            written = False
        elif not written:
            written = True
            _log.error("fault: %s; the last ticks are in %s", FAULT_WORDS[int(player["fault"])], path)
            try:
                path.write_text(
                    trace.as_csv(trace.ordered(servo.trace, int(player["traced"]))), encoding="utf-8"
                )
            except OSError as error:  # a full disk must not end the servo
                _log.error("%s cannot be written: %s", path, error.strerror)


def main() -> int:
    """Parse the command line, make the block, run the loop on its own thread, wait for a signal."""
    arguments = argparse.ArgumentParser(prog="haptic_server.servo", description=__doc__)
    arguments.add_argument(
        "--run-dir", type=Path, required=True, help="holds scene.toml; the block is made here"
    )
    given = arguments.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})

    text = given.run_dir / files.SCENE
    scene = parse(text.read_text(encoding="utf-8"), str(text))
    try:
        envelope.require(law_of(scene), limits_of(scene, specification_of(scene)))
    except Refusal as refusal:
        _log.error("%s: the scene itself is outside the envelope: %s", text, refusal)
        return 2
    rehearsal = memory.prepare(scene, block.in_memory(law_of(scene)))
    loop.run_virtual(rehearsal, 200, 0)  # compiles everything and touches every path before real time starts
    poke(rehearsal.block.control, block.STOP, 1)
    loop.run_paced(rehearsal)

    left = block.legacy(given.run_dir, law_of(scene).dtype)
    if left is None or not fits(left.law[0], rehearsal.plan[0]):
        left = block.Legacy(0, law_of(scene), held=False)
    try:
        mine = block.create(given.run_dir, left.law, left.revision)
    except OSError as error:
        _log.error("%s: no room for the servo's block: %s", given.run_dir, error.strerror)
        return 3
    servo = memory.prepare(scene, mine, left.held)
    granted: dict[str, str] = {}

    ticks: list[int] = []

    def run() -> None:
        try:
            granted.update(priority.claim(scene.servo.cpu))
            _tell_granted(given.run_dir / files.GRANTED, granted)
            ticks.append(loop.run_paced(servo))
        finally:  # whatever ended it: a process without its loop must end too, to be started again
            os.kill(os.getpid(), signal.SIGTERM)

    thread = threading.Thread(target=run, name="servo")
    thread.start()
    _log.info("scene %s, %d Hz, simulated stick", scene.name, scene.servo.rate_Hz)
    _watch(servo, given.run_dir / files.TRACE)
    poke(mine.control, block.STOP, 1)
    thread.join()
    return 0 if ticks else 1


if __name__ == "__main__":
    sys.exit(main())
