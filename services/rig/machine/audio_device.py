"""Sinks of `drumstick audio-test`: the sound server's own, and the priority of the thread that plays them.

Main thread. Linux tells a thread's priority; on other systems it stays unknown, and is left as it is.
"""

import contextlib
import ctypes
import ctypes.util
import os
import sys
import threading
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rig.machine.audio_advice import PRIORITY
from sound_server.sinks.device import DeviceSink
from sound_server.sinks.load_meter import noted
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.selection import open_sink
from sound_server.sinks.sink import Sink, SinkError

NULL, UNKNOWN = "null", "unknown"
_ANY_BLOCK = 0  # PortAudio's word for the one that suits the device
_NO_START_SERVER = 0x01  # JackNoStartServer


class NullSink(PacedSink):
    """The sound server's `null`, which also shows its blocks, as a device does."""

    def __init__(self, rate_Hz: int, block: int) -> None:
        super().__init__(NULL, rate_Hz, block)
        self.latency_ms = 0.0  # to the first frame, which sounds at once

    @property
    def blocks(self) -> npt.NDArray[np.int64]:
        """The newest blocks, as load_meter.noted returns them."""
        return noted(self._counters)


TestedSink = NullSink | DeviceSink


def opened(audio: str, rate_Hz: int, block: int) -> TestedSink:
    """The sink for `--audio`, which plays in blocks of this many frames. SinkError where it does not."""
    if audio == NULL:
        return NullSink(rate_Hz, block)
    sink = open_sink(audio, rate_Hz, block, awaited=True)
    if not isinstance(sink, DeviceSink):
        raise SinkError(2, f"--audio {audio}: give auto, null or part of a device's name")
    if is_jack(sink):
        try:
            _check_jack_block(block)
        except SinkError:
            sink.close()
            raise
    return sink


def only_block(audio: str, rate_Hz: int) -> int | None:
    """The one block of a JACK server, frames; None where the device leaves the choice. SinkError: no such device."""
    if audio == NULL:
        return None
    sink = open_sink(audio, rate_Hz, _ANY_BLOCK, awaited=True)
    try:
        return _jack_block() if is_jack(sink) else None
    finally:
        sink.close()


def is_jack(sink: Sink) -> bool:
    """True when it plays through JACK."""
    return "(JACK" in sink.description


def _check_jack_block(block: int) -> None:
    own = _jack_block()
    if own != block:
        raise SinkError(
            3,
            f"JACK plays in blocks of {own} frames, whatever is asked of it; to change it: jack_bufsize {block}",
        )


def _jack_block() -> int:
    # PortAudio cuts and joins JACK's blocks as asked, which makes none of them sooner; it does not tell their size.
    try:
        jack = ctypes.CDLL(ctypes.util.find_library("jack") or "libjack.so.0")
    except OSError as error:
        raise SinkError(3, f"JACK's block size is not known, its library does not load: {error}") from None
    jack.jack_client_open.restype = ctypes.c_void_p
    client = ctypes.c_void_p(jack.jack_client_open(b"drumstick-block", _NO_START_SERVER, None))
    if not client:
        raise SinkError(3, "the JACK server takes no other client")
    frames = int(jack.jack_get_buffer_size(client))
    jack.jack_client_close(client)
    return frames


class Scheduling(NamedTuple):
    """Policy and priority of a thread, as os.sched_getscheduler tells them."""

    policy: int
    priority: int

    @property
    def real_time(self) -> bool:
        """True for SCHED_FIFO and SCHED_RR."""
        return self.policy & ~os.SCHED_RESET_ON_FORK in (os.SCHED_FIFO, os.SCHED_RR)

    @property
    def words(self) -> str:
        """Words for it: "SCHED_FIFO 5", or "ordinary"."""
        if not self.real_time:
            return "ordinary"
        fifo = self.policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        return f"{'SCHED_FIFO' if fifo else 'SCHED_RR'} {self.priority}"


def run_ns() -> dict[int, int]:
    """Time that each thread of this process but the caller's has run, ns, by its number; empty where nobody tells."""
    found: dict[int, int] = {}
    if sys.platform.startswith("linux"):
        own = threading.get_native_id()
        for task in Path("/proc/self/task").iterdir():
            with contextlib.suppress(FileNotFoundError):  # it has ended; or the kernel counts nothing
                found[int(task.name)] = int((task / "schedstat").read_text().split()[0])
        found.pop(own, None)
    return found


class AudioThread:
    """The thread that plays a sink, by its number."""

    def __init__(self, ident: int) -> None:
        """ProcessLookupError where it has ended."""
        self.ident = ident
        self.granted = self.now()

    @property
    def words(self) -> str:
        """Words for the scheduling that it has now; "unknown" where it has ended, as that of a lost device."""
        try:
            return self.now().words
        except ProcessLookupError:
            return UNKNOWN

    def now(self) -> Scheduling:
        """Scheduling that it has now. ProcessLookupError where it has ended."""
        priority = os.sched_getparam(self.ident).sched_priority
        return Scheduling(os.sched_getscheduler(self.ident), priority)

    def set(self, to: Scheduling) -> bool:
        """Schedule it so; False where the system refuses, or it has ended."""
        try:
            os.sched_setscheduler(self.ident, to.policy, os.sched_param(to.priority))
        except (PermissionError, ProcessLookupError):
            return False
        return True

    def other(self) -> Scheduling:
        """The other scheduling to try: an ordinary thread's, or real time where it has none."""
        if self.granted.real_time:
            return Scheduling(os.SCHED_OTHER, 0)
        return Scheduling(os.SCHED_FIFO, PRIORITY)


def audio_thread(before: dict[int, int]) -> AudioThread | None:
    """The thread that ran most since `before`, which `run_ns` told; the drum sounds meanwhile. None where not
    known, or where it has ended."""
    ran = {ident: ns - before.get(ident, 0) for ident, ns in run_ns().items()}
    try:
        return AudioThread(max(ran, key=lambda ident: ran[ident])) if ran else None
    except ProcessLookupError:
        return None
