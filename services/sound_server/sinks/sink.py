"""Interface and counters of every sink."""

from typing import Annotated, Protocol

import numpy as np
import numpy.typing as npt

from realtime.records import Record, dtype_of
from sound_server.mixer import Mixer

NOTED = 4096  # blocks


class SinkCounters(Record):
    """Written by the audio thread, read by any. `load` is the smoothed share of a block's time that rendering takes;
    `expected_ns` is when the next block should begin; all since `aside_since_ns` (0: none) began on one side of that,
    by `least_aside_ns` or more. `calls` counts blocks. `noted` tells of the newest blocks, in turn: when rendering
    began (monotonic), how long it took, ns, and how many pulses the drums had been given by then.
    """

    rate_Hz: float
    channels: int
    load: float
    xruns: int
    calls: int
    expected_ns: int
    aside_since_ns: int
    least_aside_ns: int
    noted: Annotated[npt.NDArray[np.int64], "i8", (NOTED, 3)]


SINK_COUNTERS = dtype_of(SinkCounters)


class SinkError(Exception):
    """A sink that cannot be had; `status` is the process's exit status (2: wrong request, 3: machine lacks it)."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


class Sink(Protocol):
    """Plays its mixer, which is empty at first. All methods belong to the server's main thread."""

    mixer: Mixer

    @property
    def is_recoverable(self) -> bool:
        """True when, once lost, it may be found again by its description."""
        ...

    @property
    def description(self) -> str:
        """Description for the log and the meter."""
        ...

    @property
    def rate_Hz(self) -> int:  # noqa: N802
        """Frames a second; engines must be built for it."""
        ...

    @property
    def latency_ms(self) -> float:
        """Time from the start of a block's rendering to its last frame's sound, without the interpolator."""
        ...

    @property
    def load(self) -> float:
        """Share of the time that rendering takes, 0..1."""
        ...

    @property
    def blocks(self) -> npt.NDArray[np.int64]:
        """The newest blocks, as load_meter.noted returns them."""
        ...

    @property
    def xruns(self) -> int:
        """Blocks that came too late since the sink was opened."""
        ...

    @property
    def turns(self) -> int:
        """Grows while the sound's thread runs, whether a drum is there or not."""
        ...

    @property
    def lost(self) -> str:
        """Reason why it plays no longer; empty while it does."""
        ...

    def close(self) -> None:
        """Stop, and finish what must be finished. May block some ten milliseconds."""
        ...
