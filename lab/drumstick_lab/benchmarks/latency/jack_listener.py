"""A JACK client that listens to one output port, and keeps each sample with JACK's frame and the time of its cycle.

Port connected to port within the server: what the sound server writes in a cycle is read here in the same cycle, sample
by sample, without converters and without a stream of PortAudio's beside it. The process callback is compiled: no
Python, no GIL, no allocation. Linux.
"""

import ctypes
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba.np.numpy_support import carray

from realtime.clock import now_ns
from realtime.kernels.jit import CFunction, cfunction

_NO_START_SERVER, _IS_INPUT, _IS_OUTPUT, _PLAYBACK = 0x01, 0x01, 0x02, 1
_AUDIO = b"32 bit float mono audio"
_POINTER, _WORD, _TEXT = ctypes.c_size_t, ctypes.c_uint32, ctypes.c_char_p
# name: (returns, takes). Pointers are whole numbers, for compiled code takes them as such.
_FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "jack_client_open": (_POINTER, (_TEXT, ctypes.c_int, _POINTER)),
    "jack_port_register": (_POINTER, (_POINTER, _TEXT, _TEXT, ctypes.c_ulong, ctypes.c_ulong)),
    "jack_port_name": (_TEXT, (_POINTER,)),
    "jack_port_by_name": (_POINTER, (_POINTER, _TEXT)),
    "jack_port_get_buffer": (ctypes.POINTER(ctypes.c_float), (_POINTER, _WORD)),
    "jack_port_get_latency_range": (None, (_POINTER, ctypes.c_int, _POINTER)),
    "jack_get_ports": (ctypes.POINTER(_TEXT), (_POINTER, _TEXT, _TEXT, ctypes.c_ulong)),
    "jack_get_sample_rate": (_WORD, (_POINTER,)),
    "jack_last_frame_time": (_WORD, (_POINTER,)),
    "jack_set_process_callback": (ctypes.c_int, (_POINTER, _POINTER, _POINTER)),
    "jack_activate": (ctypes.c_int, (_POINTER,)),
    "jack_connect": (ctypes.c_int, (_POINTER, _TEXT, _TEXT)),
    "jack_client_close": (ctypes.c_int, (_POINTER,)),
}
_SAMPLES, _CYCLES, _TIMESPEC, _HEAD = 0, 1, 2, 4  # whole numbers at the head of the memory
_COLUMNS = 3
_array: Any = carray  # numba knows it by value; its own annotations do not fit addresses
Integers = npt.NDArray[np.int64]
Samples = npt.NDArray[np.float32]


class Recorded(NamedTuple):
    """Sound that was heard. Rows of `cycles`: number of its first sample; JACK's frame of that; when the callback ran, monotonic
    ns."""

    samples: Samples
    cycles: Integers
    rate_Hz: int


def _library() -> Any:
    jack: Any = ctypes.CDLL("libjack.so.0")
    for name, (returns, takes) in _FUNCTIONS.items():
        function = getattr(jack, name)
        function.restype, function.argtypes = returns, takes
    return jack


def _callback(jack: Any, client: int, port: int, most_cycles: int, most_samples: int) -> CFunction:
    get_buffer, frame_of_cycle = jack.jack_port_get_buffer, jack.jack_last_frame_time
    begin, end = _HEAD, _HEAD + _COLUMNS * most_cycles
    whole = end + (most_samples + 1) // 2

    @cfunction("int32(uint32, voidptr)", cache=False)  # a closure over one client's addresses
    def process(frames: Any, own: Any) -> int:
        memory = _array(own, (whole,), np.int64)
        first, cycle = memory[_SAMPLES], memory[_CYCLES]
        if first + frames > most_samples or cycle >= most_cycles:
            return 0
        row = memory[begin:end].reshape(most_cycles, _COLUMNS)[cycle]
        row[0], row[1] = first, frame_of_cycle(client)
        row[2] = now_ns(memory[_TIMESPEC : _TIMESPEC + 2])
        heard = _array(get_buffer(port, frames), (frames,))
        memory[end:].view(np.float32)[first : first + frames] = heard
        memory[_SAMPLES], memory[_CYCLES] = first + frames, cycle + 1
        return 0

    return process


class JackListener:
    """Listens from `listen` to `close`, for at most so many seconds. Control thread. Raises OSError."""

    def __init__(self, name: str, seconds: float, block: int) -> None:
        self._jack = _library()
        self._client = self._jack.jack_client_open(name.encode(), _NO_START_SERVER, 0)
        if not self._client:
            raise OSError("no JACK server takes this client")
        self.rate_Hz = int(self._jack.jack_get_sample_rate(self._client))
        self._most_samples = round(seconds * self.rate_Hz)
        self._most_cycles = self._most_samples // block + 1
        self._memory = np.ones(_HEAD + _COLUMNS * self._most_cycles + (self._most_samples + 1) // 2, np.int64)
        self._memory[:] = 0  # written once, so that the callback finds its pages
        self._port = self._jack.jack_port_register(self._client, b"in", _AUDIO, _IS_INPUT, 0)
        self._process = _callback(self._jack, self._client, self._port, self._most_cycles, self._most_samples)

    def outputs(self) -> list[str]:
        """Names of the ports by which other clients' audio leaves, in the order in which JACK knows them."""
        found = self._jack.jack_get_ports(self._client, b"", _AUDIO, _IS_OUTPUT)
        names: list[str] = []
        while found and (name := found[len(names)]):
            names.append(name.decode())
        return [name for name in names if not name.startswith("system:")]

    def playback_latency_ms(self) -> float:
        """Delay from its frame after which a sample leaves the device, as JACK tells of the device's first output."""
        port = self._jack.jack_port_by_name(self._client, b"system:playback_1")
        found = np.zeros(2, np.uint32)
        self._jack.jack_port_get_latency_range(port, _PLAYBACK, found.ctypes.data)
        return 1e3 * float(found[1]) / self.rate_Hz

    def listen(self, output: str) -> None:
        """Begin, at this port."""
        jack, client = self._jack, self._client
        jack.jack_set_process_callback(client, self._process.address, self._memory.ctypes.data)
        if jack.jack_activate(client) != 0:
            raise OSError("JACK does not start this client")
        if (failed := jack.jack_connect(client, output.encode(), jack.jack_port_name(self._port))) != 0:
            raise OSError(f"JACK does not connect {output}: {failed}")

    @property
    def _heard(self) -> Samples:
        count = int(self._memory[_SAMPLES])
        return self._memory[_HEAD + _COLUMNS * self._most_cycles :].view(np.float32)[:count]

    @property
    def loudest(self) -> float:
        """Peak of the samples so far."""
        return float(np.abs(self._heard).max(initial=0.0))

    def close(self) -> Recorded:
        """End; what was heard."""
        self._jack.jack_client_close(self._client)
        rows = self._memory[_HEAD : _HEAD + _COLUMNS * self._most_cycles].reshape(-1, _COLUMNS)
        return Recorded(self._heard, rows[: int(self._memory[_CYCLES])], self.rate_Hz)
