"""Sound without a device: a thread that renders in real time for nobody (`null`) or into a WAV file.

The compiled loop holds no GIL and sleeps to absolute deadlines. It comes back to Python twenty times a second to
write. When the machine stalls, the loop catches up, so the file's time stays the wall's; after a second it gives up.
"""

import threading
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from realtime.clock import now_ns, sleep_until
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import Records
from sound_server.mixer import MixBuffers, Mixer
from sound_server.sinks.load_meter import noted, timed_block
from sound_server.sinks.sink import SINK_COUNTERS, SinkCounters

_CHUNK_S = 0.05
_POLL_S = 0.02
_LATE_NS = 50_000_000
_GIVE_UP_NS = 1_000_000_000

Recorder = Callable[[npt.NDArray[np.float32]], None]


@njit()
def play_chunk(
    buffers: MixBuffers,
    counters: Records,
    out: npt.NDArray[np.float32],
    block: int,
    start_ns: int,
    clock: npt.NDArray[np.int64],
) -> None:
    """Fill `out` block by block, each at its own time after `start_ns`. Sink's thread; blocks as long as it plays."""
    buffers = borrowed_view(buffers)
    counts: SinkCounters = counters[0]
    mode = flush_denormals()
    first = 0
    while first < out.shape[0]:
        last = min(first + block, out.shape[0])
        at = start_ns + int(first * 1e9 / counts.rate_Hz)
        while now_ns(clock) < at:
            sleep_until(clock, at)
        timed_block(buffers, counters, out[first:last], at, clock)
        first = last
    restore(mode)


class PacedSink:
    """`null`, or a recording: `record` gets every chunk, float32 of shape (n, channels), on the sink's own thread."""

    is_recoverable = False

    def __init__(
        self,
        description: str,
        rate_Hz: int,
        block: int,
        record: Recorder | None = None,
        finish: Callable[[], None] | None = None,
        channels: int = 2,
    ) -> None:
        self.description = description
        self.rate_Hz = rate_Hz
        self.latency_ms = 1e3 * block / rate_Hz
        self._block = block
        self._record = record
        self._finish = finish
        self.turns = 0  # grows while the thread runs, before the first drum too
        self._counters: Records = np.zeros(1, SINK_COUNTERS)
        self._counters["rate_Hz"], self._counters["channels"] = rate_Hz, channels
        self.mixer = Mixer(rate_Hz, channels)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="audio", daemon=True)
        self._thread.start()

    @property
    def load(self) -> float:
        """Share of the time that rendering takes."""
        return float(self._counters["load"][0])

    @property
    def blocks(self) -> npt.NDArray[np.int64]:
        """The newest blocks, as load_meter.noted returns them."""
        return noted(self._counters)

    @property
    def xruns(self) -> int:
        """Chunks that began more than 50 ms late."""
        return int(self._counters["xruns"][0])

    @property
    def lost(self) -> str:
        """Empty, unless the thread died of a fault of ours (its traceback is in the log)."""
        return "" if self._thread.is_alive() or self._stop.is_set() else "the audio thread ended"

    def close(self) -> None:
        """Stop within a chunk, and finish the recording."""
        self._stop.set()
        self._thread.join()
        self.mixer.close()
        if self._finish is not None:
            self._finish()

    def _run(self) -> None:
        # The chunk is a whole number of blocks: a short block at its end would read as a higher load.
        blocks = max(1, round(_CHUNK_S * self.rate_Hz / self._block))
        out = np.zeros((blocks * self._block, self.mixer.buffers.bus.shape[1]), np.float32)
        clock = np.zeros(2, np.int64)
        buffers = self.mixer.buffers
        play_chunk(buffers, self._counters, out[:0], self._block, 0, clock)  # compiles, where it must
        while self.mixer.drums == 0:  # a recording begins with the first drum
            self.turns += 1
            if self._stop.wait(_POLL_S):
                return
        origin_ns, frames = time.monotonic_ns(), 0
        while not self._stop.is_set():
            self.turns += 1
            start_ns = origin_ns + frames * 1_000_000_000 // self.rate_Hz
            late_ns = time.monotonic_ns() - start_ns
            if late_ns > _LATE_NS:
                self._counters["xruns"] += 1
            if late_ns > _GIVE_UP_NS:
                origin_ns, frames = time.monotonic_ns(), 0
                continue
            play_chunk(buffers, self._counters, out, self._block, start_ns, clock)
            frames += len(out)
            if self._record is not None:
                self._record(out)
