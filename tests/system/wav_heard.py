"""Sound in the WAV file that a sound server wrote."""

import wave
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rig_process import Rig, running

RATE = 48000


@contextmanager
def heard_in(file: Path, scene: str) -> Iterator[Rig]:
    """A whole rig that plays the text of a scene, and what it sounds like in `file`."""
    (written := file.with_suffix(".toml")).write_text(scene, encoding="utf-8")
    with running("up", "--scene", str(written), "--audio", f"wav:{file}") as started:
        yield started


def sound_in(path: Path) -> npt.NDArray[np.float64]:
    with wave.open(str(path)) as file:
        assert file.getframerate() == RATE
        return np.frombuffer(file.readframes(file.getnframes()), "<i2").reshape(-1, 2) / 32767.0


def onsets_s(sound: npt.NDArray[np.float64], apart_s: float) -> npt.NDArray[np.float64]:
    """Beginnings of blows: where the loudness of a millisecond, after a pause, leaves that of the ring before."""
    power = (sound**2).sum(axis=1)
    loud = np.flatnonzero(power > 1e-6 * power.max())
    found = [loud[0]]
    for place in loud:
        before = power[max(place - round(apart_s * RATE / 2), found[-1] + 1) : place]
        if place - found[-1] > apart_s * RATE / 2 and before.size and before.max() < 1e-6 * power.max():
            found.append(place)
    return np.array(found) / RATE
