"""Size of recordings and cost of their recorder: drumstick lab recording-size [--seconds 20].

A rig plays `roll` with a streamed drum, a sound server beside it; it is recorded without and with the contacts' force.
Bytes and messages are counted; CPU time is the recorder's own, after it has begun, and depends on the machine.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from recorder_process import Recorder
from rig_process import Listener, Rig, running, wait_for

from drumstick_lab.measuring import stored
from protocol.messages import Meter
from rig.recording.reading import read
from streamed_engine import streamed_text


def cpu_s(pid: int) -> float:
    """CPU time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def recorded(rig: Rig, out: Path, seconds: float, *options: str) -> dict[str, Any]:
    """One recording's row, per second of it."""
    recorder = Recorder(rig, out, "--duration", str(seconds), *options)
    recorder.recorded()
    begun, before = time.monotonic(), cpu_s(recorder.process.pid)
    time.sleep(seconds - 2.0)
    spent = (cpu_s(recorder.process.pid) - before) / (time.monotonic() - begun)
    assert recorder.ended()[0] == 0
    found = read(out)
    assert found.torn == ""
    span_s = (found.events[-1].log_ns - found.events[0].log_ns) * 1e-9
    counts: dict[str, float] = {}
    for event in found.events:
        counts[event.channel.topic] = counts.get(event.channel.topic, 0.0) + 1.0 / span_s
    return {
        "kB_per_minute": out.stat().st_size / 1e3 / span_s * 60.0,
        "messages_per_s": {topic: rate for topic, rate in sorted(counts.items()) if rate > 0.5},
        "share_of_core": spent,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "streamed.toml"
        scene.write_text(streamed_text(), encoding="utf-8")
        with running("up", "--scene", str(scene)) as rig:
            session = rig.client()
            meters = Listener(session, rig.keys.meter, Meter)
            wait_for("sound", lambda: meters.got and meters.got[-1].played > 20)
            rows = {
                "without": recorded(rig, Path(folder) / "a.mcap", given.seconds),
                "with": recorded(rig, Path(folder) / "b.mcap", given.seconds, "--force"),
            }
            session.close()
    result = {"seconds": given.seconds, "rows": rows}
    stored.store("recording_size", result)


if __name__ == "__main__":
    main()
