"""Second thread of a drum whose scene asks for one (`[mesh] threads`): it takes parts of the mesh's sweep.

It has real-time priority, and sleeps while the drum rests. Where that may not be had, or there is only one core, the
audio thread computes the whole mesh alone. Control threads.
"""

import functools
import logging
import os
import sys
import threading

import numpy as np

from drumstick.drum.engine import Engine
from drumstick.drum.memory.shared_sweep import STOP
from drumstick.drum.threads.shared_sweep import help_along
from realtime.atomics import poke
from realtime.records import is_there

PRIORITY = 70  # below the servo's 80
NAME = "second_sweep"


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


@functools.cache
def _warn_once(words: str) -> None:
    logging.warning("[mesh] threads = 2: the audio thread computes the whole mesh alone, for %s", words)


def second_thread(engine: Engine) -> "SecondThread | None":
    """A second thread for this drum, running; None where its scene asks for none, or there is only one core."""
    if not is_there(engine.shared_sweep):
        return None
    if cores() < 2:
        _warn_once("there is only one core")
        return None
    return SecondThread(engine)


def make_ready(engine: Engine) -> None:
    """Compile or load what a second thread needs for engines of this type. Seconds."""
    if is_there(engine.shared_sweep):
        poke(engine.shared_sweep.cells, STOP, 1)
        help_along(engine, np.zeros(2, np.int64))
        poke(engine.shared_sweep.cells, STOP, 0)


class SecondThread:
    """Running from the start until `end`; it keeps the engine's arrays alive that long."""

    def __init__(self, engine: Engine) -> None:
        self._cells = engine.shared_sweep.cells
        poke(self._cells, STOP, 0)
        threading.Thread(target=_run, args=(engine,), name=NAME, daemon=True).start()

    def end(self) -> None:
        """Let it end, within some milliseconds; the engine may sound on without it."""
        poke(self._cells, STOP, 1)


def _run(engine: Engine) -> None:
    if sys.platform == "linux":
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        except PermissionError:
            # An ordinary thread could be held up in a part that the audio thread then waits for.
            _warn_once("a second thread may not have real-time priority (raise the rtprio limit)")
            return
    help_along(engine, np.zeros(2, np.int64))
