"""Hole at a change of scene, in strikes and in sound: drumstick lab scene-change [--changes 20].

Strikes: from the last of the scene before to the first of the one after, by their own times. Sound: the longest stretch
of the WAV file, 5 s from the first strike on, in which no sample reaches -60 dB of the peak. Scenes are compiled beforehand.
"""

import argparse
import json
import statistics
import tempfile
import time
import wave
from pathlib import Path

import numpy as np
from rig_process import Listener, Rig, ask, running, wait_for

from drumstick_lab.measuring import stored
from protocol.messages import Strike

SCENES = ("tom", "roll")  # by turns; the rig starts with the last
_QUIET, _PLAYS_S = 1e-3, 3.0


def strikes_gaps_s(rig: Rig, changes: int) -> list[float]:
    session = rig.client()
    heard = Listener(session, rig.keys.strike, Strike)
    wait_for("strikes", lambda: len(heard.got) > 20)
    gaps: list[float] = []
    for change in range(changes):
        time.sleep(_PLAYS_S)
        boot = heard.got[-1].boot
        ask(session, rig.keys.scene_load, SCENES[change % 2])
        after = wait_for(
            "the other scene", lambda b=boot: [s for s in list(heard.got) if s.boot != b][-1:], 180
        )
        wait_for("strikes", lambda b=after[0].boot: sum(s.boot == b for s in list(heard.got)) > 20)
        times = {b: [s.t_ns for s in heard.got if s.boot == b] for b in (boot, after[0].boot)}
        gaps.append((times[after[0].boot][0] - times[boot][-1]) * 1e-9)
        heard.got.clear()
        wait_for("strikes", lambda: heard.got)
    session.close()
    return gaps


def longest_silence_s(path: Path) -> float:
    with wave.open(str(path)) as file:
        rate, frames = file.getframerate(), file.readframes(file.getnframes())
    peaks = np.abs(np.frombuffer(frames, "<i2").astype(np.float64)).reshape(-1, 2).max(axis=1)
    loud = np.flatnonzero(peaks > _QUIET * peaks.max())
    return float(np.diff(loud[loud > loud[0] + 5 * rate]).max() / rate)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--changes", type=int, default=20)
    changes = parser.parse_args().changes
    for scene in SCENES:
        with running("up", "--scene", scene, "--duration", "1") as warm:
            warm.process.wait(300)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heard.wav"
        with running("up", "--scene", SCENES[-1], "--audio", f"wav:{path}") as rig:
            gaps = strikes_gaps_s(rig, changes)
            rig.stop()
        silence_s = longest_silence_s(path)
    result = {
        "changes": changes, "strikes_gap_p50_s": statistics.median(gaps),
        "strikes_gap_worst_s": max(gaps), "longest_silence_s": silence_s,
    }  # fmt: skip
    stored.store("scene_change", result)
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
