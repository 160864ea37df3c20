"""SuperCollider's membranes through `scsynth -N`: a SynthDef and a score, written as scsynth reads them.

Formats: "Synth Definition File Format" (version 2) and "Non-Realtime Synthesis" of SuperCollider's documentation.
"""

import os
import re
import resource
import struct
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt

RATE_HZ = 48_000
_SCALAR, _AUDIO = 0, 2
_ADD = 0
_TENSION, _LOSS = 0.05, 0.99999
_IMPULSES_HZ = 10.0  # so often that the membranes never decay into denormals
_MAX_S = 60.0  # a score takes a part of a second; an scsynth that hangs is ended
_SIZE = 12  # of the plug-in's shapes, in half spacings across


def _inside(kind: str, x: int, y: int) -> bool:
    # The plug-in's own rule (Membrane_shape.c), in half spacings and rows.
    x, y = abs(x), abs(y)
    if kind == "MembraneCircle":
        return x * x + 3 * y * y < (_SIZE // 2) ** 2
    return x < _SIZE // 2 and y < _SIZE // 4 and (x < _SIZE // 4 or x < _SIZE // 2 - y)


def shape(kind: str) -> tuple[int, int]:
    """Junctions of the membrane, and delay lines: two a line, one a junction, one more on the rim."""
    around = ((1, 1), (2, 0), (1, -1), (-1, -1), (-2, 0), (-1, 1))
    reach = range(-_SIZE, _SIZE + 1)
    points = [(x, y) for x in reach for y in reach if (x + y) % 2 == 0 and _inside(kind, x, y)]
    beside = [sum(_inside(kind, x + dx, y + dy) for dx, dy in around) for x, y in points]
    return len(points), sum(beside) + len(points) + sum(count < 6 for count in beside)


def _name(text: str) -> bytes:
    return struct.pack(">B", len(text)) + text.encode()


def _unit(kind: str, inputs: list[tuple[int, int]], outputs: int) -> bytes:
    head = _name(kind) + struct.pack(">biih", _AUDIO, len(inputs), outputs, _ADD)
    return head + b"".join(struct.pack(">ii", *i) for i in inputs) + bytes([_AUDIO]) * outputs


def synthdef(name: str, kind: str, membranes: int, impulses_Hz: float = _IMPULSES_HZ) -> bytes:
    """Impulses through so many membranes of a kind (none: straight on), added up, to the first output."""
    constants = (impulses_Hz, 0.0, _TENSION, _LOSS)
    frequency, zero, tension, loss = ((-1, at) for at in range(4))
    units = [_unit("Impulse", [frequency, zero], 1)]
    sounds = [(0, 0)] * max(membranes, 1)
    if kind:
        units += [_unit(kind, [(0, 0), tension, loss], 1) for _ in range(membranes)]
        sounds = [(at, 0) for at in range(1, len(units))]
    total = sounds[0]
    for sound in sounds[1:]:
        units.append(_unit("BinaryOpUGen", [total, sound], 1))
        total = (len(units) - 1, 0)
    units.append(_unit("Out", [zero, total], 0))
    body = _name(name) + struct.pack(">i", len(constants)) + struct.pack(">4f", *constants)
    body += struct.pack(">iii", 0, 0, len(units)) + b"".join(units) + struct.pack(">h", 0)
    return b"SCgf" + struct.pack(">ih", 2, 1) + body


def _padded(text: bytes) -> bytes:
    return text + b"\0" * (4 - len(text) % 4)


def _message(address: str, *values: bytes | str | int) -> bytes:
    tags, body = ",", b""
    for value in values:
        if isinstance(value, bytes):
            tags, body = tags + "b", body + struct.pack(">i", len(value)) + value + b"\0" * (-len(value) % 4)
        elif isinstance(value, str):
            tags, body = tags + "s", body + _padded(value.encode())
        else:
            tags, body = tags + "i", body + struct.pack(">i", value)
    return _padded(address.encode()) + _padded(tags.encode()) + body


def _bundle(at_s: float, message: bytes) -> bytes:
    time = struct.pack(">II", int(at_s), int(at_s % 1.0 * 2**32))
    body = _padded(b"#bundle") + time + struct.pack(">i", len(message)) + message
    return struct.pack(">i", len(body)) + body


def score(kind: str, membranes: int, seconds: float, impulses_Hz: float = _IMPULSES_HZ) -> bytes:
    """A binary OSC score that plays the SynthDef for so long."""
    start = _bundle(0.0, _message("/d_recv", synthdef("drums", kind, membranes, impulses_Hz)))
    start += _bundle(0.0, _message("/s_new", "drums", 1000, 0, 0))
    return start + _bundle(seconds, _message("/c_set", 0, 0))


def _played(score: Path, sound: Path, sample: str) -> tuple[str, float]:
    # What scsynth said, and its CPU time, s: no other child may end meanwhile. ChildProcessError if it did not play,
    # TimeoutExpired if it hangs.
    command = ["scsynth", "-N", str(score), "_", str(sound), str(RATE_HZ), "WAV", sample]
    command += ["-o", "1", "-D", "0", "-V", "1"]
    environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
        timeout=_MAX_S,
        check=False,
    )
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    if process.returncode != 0:
        raise ChildProcessError(f"scsynth ended with {process.returncode}: {process.stdout}")
    return process.stdout, used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime


class Membranes:
    """`cpu_s` renders the score once, in a process of its own. kind "" is the same score without membranes."""

    def __init__(self, folder: Path, kind: str, membranes: int, seconds: float) -> None:
        self._kind = kind
        self._membranes = membranes
        self._score = folder / f"{kind or 'without'}.osc"
        self._sound = folder / f"{kind or 'without'}.wav"
        self._score.write_bytes(score(kind, membranes, seconds))

    def cpu_s(self) -> float:
        """User and system time of the process. ChildProcessError if scsynth did not play what was meant."""
        said, spent_s = _played(self._score, self._sound, "int16")
        if self._kind:
            delays = [int(count) for count in re.findall(r"(\d+) delays initialised", said)]
            if delays != [shape(self._kind)[1]] * self._membranes:
                raise ChildProcessError(f"scsynth built other membranes: {said}")
            if len(set(self._sound.read_bytes()[44:])) < 2:
                raise ChildProcessError(f"scsynth played silence: {said}")
        return spent_s


def response(folder: Path, kind: str, seconds: float) -> npt.NDArray[np.float64]:
    """Signal of a membrane's own pickup, at its centre, after one impulse there. ChildProcessError as above."""
    score_file, sound = folder / "impulse.osc", folder / "impulse.wav"
    score_file.write_bytes(score(kind, 1, seconds, 0.0))  # of 0 Hz: one impulse
    _played(score_file, sound, "float")
    written = sound.read_bytes()
    return np.frombuffer(written[written.index(b"data") + 8 :], "<f4").astype(np.float64)
