"""`drumstick audio-test`: which block size and priority the sound server needs here, and what its delay means."""

import json
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from typing import Any

from rig import scene_file
from rig.exit_status import GIVEN, LACKING, OURS, CommandError, usage_error
from rig.machine.audio_advice import BLOCKS

STROKES_PER_S = (24.0, 100.0)  # a fast roll; and where strokes are no strokes any more but a tone
_SIMULATED_S = 5.0
_WIDTH = 110
_START_S = 300.0  # compiling, on a machine that is busy
_BLOCK_S = 10.0  # beside playing: a block size's device is opened and closed
_UNSEEN = (
    "A device's time is counted to the end of the block where a strike begins to sound: the first sample may come up to"
    " a block sooner. Not in these figures: the way of a strike from the force loop over gateway and network to the"
    " sound server (docs/measured.md), the converters of the sound card, loudspeakers and mixing desk with a delay of"
    " their own, and the air: 2.9 ms for each metre."
)


def _strikes_per_s(name: str, scene: Any) -> float:
    # As dense as the scene's stick plays, or as a fast roll where that is denser.
    from drumstick.public.run import simulate

    contacts = len(simulate(scene, _SIMULATED_S, gesture=scene_file.gesture(name, scene)).contacts)
    fewest, most = STROKES_PER_S
    return min(max(fewest, contacts / _SIMULATED_S), most)


def _line(row: dict[str, Any]) -> str:
    name = row["priority"] + ("" if row["granted"] else " *")
    shares = "".join(f"{100.0 * row[key]:7.1f}" for key in ("share_p50", "share_p99", "share_worst"))
    late, xruns = (f"{row[key]} ({row[f'{key}_ours']})" for key in ("late", "xruns"))
    delay = "".join(f"{ms:6.1f}" for ms in row["delay_ms"].values())
    mark = f"lost: {row['lost']}" if row["lost"] else "fits" if row["fits"] else "does not fit"
    return (
        f"{row['block']:6d}{row['block_ms']:6.1f}  {name:16s}{shares}{late:>11s}{xruns:>9s} {delay}  {mark}"
    )


def _shown(found: dict[str, Any]) -> list[str]:
    lines = [
        f"scene {found['scene']} on {found['device']} at {found['rate_Hz']} Hz: {found['drum']}",
        f"{found['strikes_per_s']:.0f} strikes a second at full level, {found['seconds']:g} s for each row",
        "",
        f"{'':30s}{'% of the block':^21s}{'late':>11s}{'xruns':>9s}  ms to the device",
        " block    ms  audio thread        p50    p99  worst     (ours)   (ours)  least usual  most",
        *map(_line, found["rows"]),
    ]
    if any(not row["granted"] for row in found["rows"]):
        lines.append("* to compare: the sound server's thread is not scheduled so here")
    lines += [f"block {one['block']}: {one['reason']}" for one in found["refused"]]
    for said in found["witnesses_refused"]:
        lines.append(f"the machine's own stalls are not told apart, witness refused: {said}")
    words = (*found["advice"], *found["perceived"], _UNSEEN)
    return [*lines, "", *(textwrap.fill(each, _WIDTH, subsequent_indent="  ") for each in words)]


def audio_test(
    scene: str, audio: str, rate_Hz: int, blocks: Sequence[int], seconds: float, as_json: bool
) -> None:
    """Measure in a process of its own, as the sound server is one, and print. Raises CommandError."""
    if audio.startswith("wav:"):
        usage_error(f"--audio {audio}: a file is never late; give auto, null or part of a device's name")
    strikes_per_s = _strikes_per_s(scene, scene_file.load(scene))
    asked = {
        "scene_text": scene_file.read(scene).text, "audio": audio, "rate_Hz": rate_Hz, "seconds": seconds,
        "strikes_per_s": strikes_per_s, "blocks": list(dict.fromkeys(blocks)),
    }  # fmt: skip
    longest_s = _START_S + 2.0 * (seconds + _BLOCK_S) * (len(blocks) or len(BLOCKS))
    command = [sys.executable, "-m", "rig.machine.audio_measurement"]
    try:
        done = subprocess.run(
            command, input=json.dumps(asked), capture_output=True, text=True, check=False, timeout=longest_s
        )
    except subprocess.TimeoutExpired:
        stands = f"the test did not end in {longest_s:.0f} s: the audio device or its server stands still"
        raise CommandError(LACKING, stands) from None
    if done.returncode in (GIVEN, LACKING):
        raise CommandError(done.returncode, done.stderr.strip().splitlines()[-1])
    if done.returncode != 0:
        raise CommandError(OURS, f"the test ended with status {done.returncode}: {done.stderr.strip()}")
    found = json.loads(done.stdout)
    print(json.dumps(found) if as_json else "\n".join(_shown(found)))
