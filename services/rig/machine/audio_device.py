"""Questions of `drumstick audio-test` to the system: JACK's block, and the priority of the thread that plays a sink.

Main thread. Linux tells a thread's priority; on other systems it stays unknown, and is left as it is.
"""

import contextlib
import ctypes
import ctypes.util
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rig.machine.audio_advice import PRIORITY
from sound_server import second_thread
from sound_server.sinks.selection import open_sink
from sound_server.sinks.sink import Sink, SinkError

NULL = "null"
_ANY_BLOCK = 0  # PortAudio's word for the one that suits the device
_NO_START_SERVER = 0x01  # JackNoStartServer


def is_jack(sink: Sink) -> bool:
    """True when it plays through JACK."""
    return "(JACK" in sink.description


def only_block(audio: str, rate_Hz: int) -> int | None:
    """The one block of a JACK server, frames; None where the device leaves the choice. SinkError: no such device.

    PortAudio cuts and joins JACK's blocks as asked, which makes none of them sooner; it does not tell their size.
    """
    if audio == NULL:
        return None
    sink = open_sink(audio, rate_Hz, _ANY_BLOCK, awaited=True)
    try:
        return _jack_block() if is_jack(sink) else None
    finally:
        sink.close()


def _jack_block() -> int:
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
    def words(self) -> str:
        """Words for it: "SCHED_FIFO 5", "ordinary", or "unknown"."""
        if self == UNKNOWN:
            return "unknown"
        known = {os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR"}
        name = known.get(self.policy & ~os.SCHED_RESET_ON_FORK)
        return f"{name} {self.priority}" if name else "ordinary"

    @property
    def other(self) -> "Scheduling":
        """The other one to try: an ordinary thread's, or real time where it has none."""
        return Scheduling(os.SCHED_OTHER, 0) if self.priority else Scheduling(os.SCHED_FIFO, PRIORITY)


UNKNOWN = Scheduling(-1, 0)


def run_ns() -> dict[int, int]:
    """Time that each thread of this process has run, ns, by its number; empty where nobody tells.

    But the caller's, and those that share a drum's mesh with the audio thread, which run nearly as much.
    """
    found: dict[int, int] = {}
    if sys.platform.startswith("linux"):
        seconds = [each.native_id for each in threading.enumerate() if each.name == second_thread.NAME]
        for task in Path("/proc/self/task").iterdir():
            with contextlib.suppress(
                FileNotFoundError, ProcessLookupError
            ):  # it has ended, or is not counted
                found[int(task.name)] = int((task / "schedstat").read_text().split()[0])
        for left_out in (threading.get_native_id(), *filter(None, seconds)):
            found.pop(left_out, None)
    return found


def audio_thread(play: Callable[[], object]) -> int | None:
    """The thread that ran most while this played a drum; None where nobody tells."""
    before = run_ns()
    play()
    # Those that came meanwhile are witnesses of stalls; the system may list one that has ended.
    ran = {thread: ns - before[thread] for thread, ns in run_ns().items() if thread in before}
    return max(ran, key=lambda thread: ran[thread], default=None)


def scheduling_of(thread: int | None) -> Scheduling:
    """Scheduling of a thread; UNKNOWN for None and for one that has ended, as that of a lost device."""
    if thread is None:
        return UNKNOWN
    try:
        return Scheduling(os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority)
    except ProcessLookupError:
        return UNKNOWN


def schedule(thread: int | None, to: Scheduling) -> bool:
    """Schedule the thread so; False where there is none, it has ended, or the system refuses."""
    if thread is None:
        return False
    try:
        os.sched_setscheduler(thread, to.policy, os.sched_param(to.priority))
    except (PermissionError, ProcessLookupError):
        return False
    return True
