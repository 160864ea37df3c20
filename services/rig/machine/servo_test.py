"""`drumstick servo-test`: ten seconds of the force loop, and whether this machine is fit for it."""

import json
import subprocess
import sys
from typing import Any

from rig import scene_file
from rig.exit_status import OURS, CommandError

_LIMITS = "fit means SCHED_FIFO, and without host stalls 99.99 % of ticks within 300 us and all within 500 us"


def _row(name: str, found: dict[str, float]) -> str:
    return f"{name:34s}" + "".join(f"{found[key]:10.1f}" for key in found)


def _shown(found: dict[str, Any]) -> list[str]:
    lines = [f"{found['ticks']} ticks of scene {found['scene']} at {found['rate_Hz']} Hz"]
    lines += [f"  {name}: {said}" for name, said in found["granted"].items()]
    lines += [f"  witness refused: {said}" for said in found["witnesses_refused"]]
    keys = [key.removesuffix("_us") for key in found["lateness"]]
    lines += ["", f"{'us':34s}" + "".join(f"{key:>10s}" for key in keys)]
    lines += [
        _row("lateness", found["lateness"]),
        _row("lateness without host stalls", found["lateness_without_host_stalls"]),
        _row("duration of a tick", found["tick"]),
        "",
        f"the host stood still {found['host_stalls']} times, {found['longest_host_stall_us']:.0f} us at the longest",
        f"this machine is {'fit' if found['fit'] else 'not fit'} for the force loop ({_LIMITS})",
    ]
    if not found["fit"]:
        lines.append("drumstick doctor tells what real-time permissions are missing")
    return lines


def servo_test(scene: str, seconds: float, as_json: bool) -> None:
    """Run the self-test in a process of its own, as the servo runs, and tell what it found. Raises CommandError."""
    text = scene_file.read(scene)
    scene_file.load(scene)
    command = [sys.executable, "-m", "haptic_server.servo.selftest", "--seconds", str(seconds)]
    done = subprocess.run([*command, "--scene-text", text.text], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CommandError(OURS, f"the self-test ended with status {done.returncode}: {done.stderr.strip()}")
    found = json.loads(done.stdout)
    print(json.dumps(found) if as_json else "\n".join(_shown(found)))
