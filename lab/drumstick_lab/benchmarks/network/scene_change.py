"""Hole at a change of scene, in strikes and in sound: drumstick lab scene-change [--changes 20].

By OSC: an OSC client asks for the other scene by `/drumstick/scene/load` and notes when `/drumstick/strike` comes: from
the last of the scene before to the first of the one after. The same by the strikes' own times, on Zenoh. In the sound:
the WAV file of the rig, for how long windows of 20 ms are 10 dB weaker than usual at a change, and how weak they
become: the drum rings on from the last strike. And the longest stretch, 5 s from the first strike on, in which no
sample reaches -60 dB of the peak. Asked for: at most half a second without a strike. Scenes are compiled beforehand.
"""

import argparse
import json
import statistics
import tempfile
import wave
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rig_process import Listener, Rig, running, wait_for

from drumstick_lab.benchmarks.network.osc_program import OscProgram
from drumstick_lab.measuring import stored
from protocol.messages import Strike

GOAL_S = 0.5
SCENES = ("tom", "roll")  # by turns; the rig starts with the last
PATIENCE_S = 600.0  # a busy machine makes a scene ready in minutes; whoever waits, waits for an event
_QUIET, _WEAK_dB, _WINDOW_S = 1e-3, 10.0, 0.02
_STRIKES = 60  # of each scene before the next is asked for: two or three seconds
Wave = npt.NDArray[np.float64]


def played(rig: Rig, changes: int) -> tuple[list[float], list[float]]:
    """Gaps by OSC, as they came, and by the strikes' own times, s."""
    session, client = rig.client(PATIENCE_S), OscProgram(rig)
    heard = Listener(session, rig.keys.strike, Strike)
    try:
        wait_for("strikes", lambda: len(heard.got) > _STRIKES, PATIENCE_S)
        by_osc, own = list[float](), list[float]()
        for change in range(changes):
            boot, osc_before = heard.got[-1].boot, len(client.strikes)
            client.load(SCENES[change % 2])

            def after(boot: int = boot) -> list[Strike]:
                return [strike for strike in list(heard.got) if strike.boot != boot]

            wait_for("the other scene", lambda f=after: len(f()) > _STRIKES, PATIENCE_S)
            before = [strike for strike in heard.got if strike.boot == boot]
            last_ns, first_ns = before[-1].t_ns, after()[0].t_ns
            own.append((first_ns - last_ns) * 1e-9)
            # By OSC the longest time between two strikes of those that came meanwhile is the one at the change.
            by_osc.append(
                float(np.diff([each.came_s for each in client.strikes[max(osc_before - 1, 0) :]]).max())
            )
            heard.got[:] = after()
            print(f"{change}: {by_osc[-1]:.3f} s by OSC, {own[-1]:.3f} s by their own times", flush=True)
    finally:
        client.close()
        session.close()  # type: ignore[no-untyped-call]
    return by_osc, own


def read(path: Path) -> tuple[Wave, int]:
    """Louder channel of each frame, and the rate, Hz."""
    with wave.open(str(path)) as file:
        rate, frames = file.getframerate(), file.readframes(file.getnframes())
    both = np.frombuffer(frames, "<i2").astype(np.float64).reshape(-1, 2)
    return both[np.arange(len(both)), np.abs(both).argmax(axis=1)], rate


def sound_dips(sound: Wave, rate: int, changes: int) -> tuple[list[float], list[float]]:
    """At the weakest places of the file, as many as there were changes: seconds for which it was weak, and how weak, dB.

    Weak beside the usual there: the median of the windows within a second of it. The start and the end are left out.
    """
    size, around = int(_WINDOW_S * rate), round(1.0 / _WINDOW_S)
    loud = np.flatnonzero(np.abs(sound) > _QUIET * np.abs(sound).max())
    whole = np.abs(sound[loud[0] + 2 * rate : loud[-1] - 3 * rate])
    peaks = np.maximum(whole[: len(whole) // size * size].reshape(-1, size).max(axis=1), 1.0)
    usual = np.array([np.median(peaks[max(n - around, 0) : n + around]) for n in range(len(peaks))])
    level_dB = 20.0 * np.log10(peaks / usual)
    left = level_dB.copy()
    weak_s, lowest_dB = list[float](), list[float]()
    for _ in range(changes):
        place = int(np.argmin(left))
        begin = max(place - around, 0)
        runs = "".join("w" if each < -_WEAK_dB else " " for each in level_dB[begin : place + around]).split()
        weak_s.append(max((len(run) for run in runs), default=0) * _WINDOW_S)
        lowest_dB.append(float(level_dB[place]))
        left[begin : place + around] = 0.0
    return weak_s, lowest_dB


def longest_silence_s(sound: Wave, rate: int) -> float:
    """The longest stretch below -60 dB of the peak."""
    loud = np.flatnonzero(np.abs(sound) > _QUIET * np.abs(sound).max())
    return float(np.diff(loud[loud > loud[0] + 5 * rate]).max() / rate)


def row(gaps: list[float]) -> dict[str, Any]:
    """p50, worst, and how many are within the goal."""
    return {
        "p50_s": statistics.median(gaps),
        "worst_s": max(gaps),
        "within_goal": sum(gap <= GOAL_S for gap in gaps),
        "all_s": [round(gap, 4) for gap in sorted(gaps)],
    }


def main() -> None:
    """Measure, tell and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--changes", type=int, default=20)
    changes = parser.parse_args().changes
    for scene in SCENES:
        with running("up", "--scene", scene, "--duration", "1") as warm:
            warm.process.wait(PATIENCE_S)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heard.wav"
        with running("up", "--scene", SCENES[-1], "--audio", f"wav:{path}") as rig:
            by_osc, own = played(rig, changes)
            rig.stop()
        sound, rate = read(path)
    weak_s, lowest_dB = sound_dips(sound, rate, changes)
    result = {
        "changes": changes,
        "goal_s": GOAL_S,
        "rows": {
            "by OSC, as they came": row(by_osc),
            "by the strikes' own times": row(own),
            "in the sound, 10 dB below the usual": row(weak_s),
        },
        "lowest_dB": {"p50": statistics.median(lowest_dB), "worst": min(lowest_dB)},
        "longest_silence_s": longest_silence_s(sound, rate),
    }
    stored.store("scene_change", result)
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
