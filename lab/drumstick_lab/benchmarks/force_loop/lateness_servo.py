"""The servo process of lateness.py: as `python -m haptic_server.servo`, but its loop keeps every tick's lateness.

drumstick lab lateness-servo --run-dir DIR [--busy]. DIR holds scene.toml, and the block is made there, so that a
real gateway can serve it. Says "ready" when it may be asked; then each line on stdin, "FIRST_NS TICKS FILE", plays a
window and is answered by one line of JSON. --busy: a thread of pure Python spins beside the loop.
"""

import argparse
import json
import sys
import threading
from pathlib import Path

import numpy as np

from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of
from haptic_server import block, files, limits
from haptic_server.servo import loop, selftest
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory


def _spin() -> None:
    count = 0
    while True:
        count += 1


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--run-dir", type=Path, required=True)
    arguments.add_argument("--busy", action="store_true")
    given = arguments.parse_args()
    scene = parse((given.run_dir / files.SCENE).read_text(encoding="utf-8"), "scene")
    device = Simulated(scene)
    specification = device.info().specification
    spare = memory.prepare(scene, block.in_memory(law_of(scene)), specification=specification)
    loop.warm_up(device.attach_simulation(spare))
    limits.write(given.run_dir, limits.limits_of(scene, specification))
    mine = block.create(given.run_dir, law_of(scene))
    servo = device.attach_simulation(memory.prepare(scene, mine, specification=specification))
    if given.busy:
        threading.Thread(target=_spin, daemon=True).start()
    print("ready", flush=True)
    for line in sys.stdin:
        first, ticks, file = line.split(maxsplit=2)
        before = {name: int(servo.tick_state[0][name]) for name in ("seq", "revision", "refused")}
        log, granted = selftest.play(servo, int(ticks), scene.servo.cpu, int(first))
        np.save(file.strip(), np.stack(log))
        (given.run_dir / files.GRANTED).write_text(json.dumps(granted), encoding="utf-8")
        changed = {name: int(servo.tick_state[0][name]) - value for name, value in before.items()}
        overruns, fault = int(servo.status[0]["overruns"]), int(servo.tick_state[0]["fault"])
        print(json.dumps({"granted": granted, **changed, "overruns": overruns, "fault": fault}), flush=True)


if __name__ == "__main__":
    main()
