"""python -m haptic_server.servo: owns the device, runs the tick until SIGTERM.

No sockets, but the one by which it tells a supervisor that it ticks, where there is one.
"""

import json
import logging
import os
import select
import signal
import threading
import time
from pathlib import Path

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import SceneError, parse
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block, contacts, files
from haptic_server.block_header import STOP
from haptic_server.limits import limits_of
from haptic_server.limits import write as write_limits
from haptic_server.records import FAULT_WORDS, NO_FAULT
from haptic_server.servo import priority, trace
from haptic_server.servo.device.protocol import Device, DeviceError
from haptic_server.servo.device.selection import chosen, may_be_opened_twice
from haptic_server.servo.force import memory
from haptic_server.servo.force.latch import passes
from haptic_server.servo.options import ServoOptions
from haptic_server.servo.watchdog import Watchdog
from haptic_server.specification import Specification
from realtime.atomics import poke
from realtime.garbage import left_lying
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.records import is_there
from realtime.regular_file import read_text, write_text
from realtime.service_options import options_of_process
from realtime.stop import StopRequest

_log = logging.getLogger("servo")
_POLL_EVERY_S = 0.25
_LISTENERS_WITHIN_S = 3.0
_LOOK_EVERY_S = 0.02  # for a signal


def _write_granted(path: Path, granted: dict[str, str]) -> None:
    try:
        write_text(path, json.dumps(granted))
    except OSError as error:  # only `doctor` reads it: no reason not to play
        _log.warning("%s cannot be written: %s", path, error.strerror)


def _save_trace(servo: memory.Servo, path: Path) -> None:
    fault = FAULT_WORDS[int(servo.tick_state[0]["fault"])]
    _log.error("fault: %s; the last ticks are in %s", fault, path)
    rows = trace.ordered(servo.trace, int(servo.tick_state[0]["traced"]))
    try:
        write_text(path, trace.as_csv(rows))
    except OSError as error:  # a full disk or a pipe that nobody reads must not end the servo
        _log.error("%s cannot be written: %s", path, error.strerror)


def _watch(
    servo: memory.Servo, path: Path, loop_thread: threading.Thread, stop: StopRequest, inherited: bool
) -> bool:
    # Until asked to stop or the loop has ended: when a fault is latched, its last thousand ticks go to a file. Returns
    # whether the present fault is on file; `inherited`: whether it is from the start.
    written = inherited
    watchdog = Watchdog(servo, Supervisor())
    while not stop.wait(_POLL_EVERY_S) and loop_thread.is_alive():
        watchdog.poll()
        ended = bool(servo.tick_state[0]["trace_ended"])
        if ended and not written:
            _save_trace(servo, path)
        written = ended
    return written


def _memory(device: Device, scene: Scene, run_dir: Path, specification: Specification) -> memory.Servo:
    """The servo's memory in a new block, which goes on from what the servo before left. OSError without room."""
    limits = limits_of(scene, specification)
    write_limits(run_dir, limits)
    left = block.inherited_state(run_dir, law_of(scene).dtype)
    spare = memory.prepare(scene, block.in_memory(law_of(scene)), specification=specification)
    if (
        scene.hand_moves_stick or scene.hand.human is not None
    ):  # a set is judged with what the hand makes of it
        spare = device.attach_simulation(spare)
    if left is not None:
        spare.pending_set["law"] = left.law
    if left is None or not passes(spare):
        left = block.InheritedState(0, law_of(scene))
    mine = block.create(run_dir, left.law, left.revision)
    servo = memory.prepare(scene, mine, specification)
    if not is_there(servo.stream):
        return servo
    return servo._replace(stream=contacts.stream_to(contacts.create(run_dir, mine.boot)))


def _await_listeners(run_dir: Path, stop: StopRequest) -> None:
    """Wait until `drumstick up` has gateway and sound, so that nobody misses the first strikes; 3 s at most."""
    awaited, until = run_dir / files.LISTENERS_AWAITED, time.monotonic() + _LISTENERS_WITHIN_S
    while awaited.exists() and time.monotonic() < until and not stop.wait(0.02):
        pass


def _await_turn(run_dir: Path, turn: int, stop: StopRequest) -> bool:
    """Wait until whoever started us says by the pipe that the servo before this one has ended; False when `stop` came
    first, or the end of that process."""
    within_s = 0.0
    while not stop.is_set():
        if select.select([turn], [], [], within_s)[0]:
            return os.read(turn, 1) != b""
        if within_s == 0.0:
            (run_dir / files.NEXT / files.SERVO_READY).touch()
        within_s = _LOOK_EVERY_S
    return False


@left_lying()
def _made_ready(device: Device, scene: Scene) -> Specification:
    """Open the device, judge the scene for it and compile the loop. DeviceError and Refusal say why not."""
    device.open()
    info = device.info()
    for words in info.words:
        _log.info("device: %s", words)
    envelope.require(law_of(scene), limits_of(scene, info.specification))
    spare = memory.prepare(scene, block.in_memory(law_of(scene)), specification=info.specification)
    device.warm_up(device.attach_simulation(spare))
    return info.specification


def _play(device: Device, scene: Scene, given: ServoOptions, stop: StopRequest) -> int:
    """Tick until asked to stop. DeviceError, Refusal and OSError say why not."""
    run_dir, ready = given.run_dir, None
    if not given.waits_for_turn or may_be_opened_twice(given.device):
        ready = _made_ready(device, scene)
    if given.waits_for_turn and not _await_turn(run_dir, given.turn, stop):
        return 0
    specification = ready or _made_ready(device, scene)  # an arm has one owner: only now
    servo = device.attach_simulation(_memory(device, scene, run_dir, specification))
    granted: dict[str, str] = {}
    ended: list[int] = []
    refused: list[DeviceError] = []

    def run() -> None:
        granted.update(priority.claim(scene.servo.cpu))
        _write_granted(run_dir / files.GRANTED, granted)
        try:
            ended.append(device.run(servo, stop))
        except DeviceError as error:  # raised again by the main thread: it ends the process
            refused.append(error)

    if not given.waits_for_turn:  # who heard the servo before this one is there
        _await_listeners(run_dir, stop)
    thread = threading.Thread(target=run, name="servo")
    inherited = bool(servo.tick_state[0]["trace_ended"])
    thread.start()
    if inherited:
        _log.warning("still held by a fault: %s", FAULT_WORDS[int(servo.tick_state[0]["fault"])])
    _log.info("scene %s, %d Hz, %s", scene.name, scene.servo.rate_Hz, specification.name)
    written = _watch(servo, run_dir / files.TRACE, thread, stop, inherited)
    poke(servo.block.control, STOP, 1)
    thread.join()
    if refused:
        raise refused[0]
    if servo.tick_state[0]["trace_ended"] and not written:
        _save_trace(servo, run_dir / files.TRACE)
    return 0 if ended == [NO_FAULT] else 1


def main() -> int:
    """Read the options, open the device, make the block, run the loop on its own thread, wait for a signal."""
    given = options_of_process(ServoOptions, "haptic_server.servo")
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    folder = given.run_dir / files.NEXT if given.waits_for_turn else given.run_dir
    text = folder / files.SCENE
    device: Device | None = None
    try:
        scene = parse(read_text(text, files.MAX_SCENE_BYTES), str(text))
        device = chosen(given.device, scene, given.pose_is_held, folder)
        return _play(device, scene, given, stop)
    except (SceneError, UnicodeDecodeError) as error:
        _log.error("%s cannot be played: %s", text, error)
        return 1
    except Refusal as refusal:
        _log.error("%s: the scene itself is outside the envelope: %s", text, refusal)
        return 2
    except DeviceError as error:
        _log.error("%s", error)
        return 3
    except OSError as error:
        _log.error("%s: the servo's files cannot be read or written: %s", given.run_dir, error.strerror)
        return 3
    finally:
        if device is not None:
            device.close()
