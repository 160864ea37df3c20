"""An audio device through PortAudio (JACK, PipeWire, ALSA ...), played by the compiled callback.

sounddevice takes a C function only through its private `_StreamBase`; where that is gone, a Python callback does the
same work, with a warning: under a busy interpreter it misses most of its deadlines.
"""

import ctypes
import logging
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import sounddevice

from realtime.records import Records
from sound_server.mixer import Mixer
from sound_server.outputs import Outputs, channel_names, channels_of
from sound_server.ranges import RATES_HZ
from sound_server.sinks import callback
from sound_server.sinks.jack_ports import name_ports
from sound_server.sinks.load_meter import noted
from sound_server.sinks.sink import SINK_COUNTERS, SinkError


class DeviceSink:
    """Opens and starts the stream at once, silent. Raises sounddevice.PortAudioError when the device refuses, and
    SinkError (2) when it has not the channels that `outputs` names."""

    is_recoverable = True

    def __init__(self, index: int, rate_Hz: int, block: int, outputs: Outputs = ()) -> None:
        facts = cast(dict[str, Any], sounddevice.query_devices(index))
        api = cast(dict[str, Any], sounddevice.query_hostapis(facts["hostapi"]))["name"]
        self.description = f"{facts['name']} ({api})"
        self.rate_Hz = playable_rate(index, rate_Hz)
        there = int(facts["max_output_channels"])
        channels = channels_of(outputs) if outputs else min(2, there)
        if channels > there:
            raise SinkError(
                2, f"{self.description} has {there} output channels; --outputs names channel {channels}"
            )
        self._counters: Records = np.zeros(1, SINK_COUNTERS)
        self._counters["rate_Hz"], self._counters["channels"] = self.rate_Hz, channels
        self.mixer = Mixer(self.rate_Hz, channels)
        self._callback_data = callback.CallbackData(self.mixer, self._counters)
        self._clock = np.zeros(2, np.int64)
        self._stream = self._open(index, block, channels)
        if api == "ALSA":
            ask_for_real_time(self._stream)
        self._stream.start()
        if outputs and "JACK" in api:
            portaudio: Any = sounddevice
            name_ports(ctypes.CDLL(portaudio._libname), channel_names(outputs))
        self.latency_ms = 1e3 * (
            block / self.rate_Hz + reported_latency_s(float(self._stream.latency), self.rate_Hz)
        )

    def _open(self, index: int, block: int, channels: int) -> Any:
        wishes = {
            "samplerate": self.rate_Hz,
            "blocksize": block,
            "device": index,
            "channels": channels,
            "dtype": "float32",
            "latency": "low",
        }
        portaudio: Any = sounddevice
        try:
            base, ffi = portaudio._StreamBase, portaudio._ffi
            function = ffi.cast("PaStreamCallback *", callback.stream_callback.address)
            userdata = ffi.cast("void *", self._callback_data.address)
        except AttributeError as missing:
            logging.warning("sounddevice without %s: audio runs in Python and will miss blocks", missing.name)
            return portaudio.OutputStream(callback=self._python_callback, **wishes)
        return base(kind="output", callback=function, wrap_callback=None, userdata=userdata, **wishes)

    def _python_callback(self, out: Any, frames: int, _time: Any, flags: Any) -> None:
        callback.fill(
            self.mixer.buffers, self._counters, out, 4 if flags.output_underflow else 0, self._clock
        )

    @property
    def load(self) -> float:
        """Share of the time that the callback takes."""
        return float(self._counters["load"][0])

    @property
    def blocks(self) -> npt.NDArray[np.int64]:
        """The newest blocks, as load_meter.noted returns them."""
        return noted(self._counters)

    @property
    def xruns(self) -> int:
        """Callbacks that PortAudio marked as coming after an underflow."""
        return int(self._counters["xruns"][0])

    @property
    def turns(self) -> int:
        """Blocks played."""
        return int(self._counters["calls"][0])

    @property
    def lost(self) -> str:
        """Reason why the stream stopped by itself; empty while it plays."""
        return "" if self._stream.active else "the device stopped"

    def close(self) -> None:
        """Stop and close the stream."""
        self._stream.close(ignore_errors=True)
        self.mixer.close()


def ask_for_real_time(stream: Any) -> None:
    """Ask for SCHED_FIFO for the thread of an ALSA stream that has not started; go on without where it may not.

    PortAudio's ALSA side asks only when told; JACK gives its clients real time itself. Not for streams of
    another host API, whose memory it would write into.
    """
    portaudio: Any = sounddevice
    try:
        pointer = int(portaudio._ffi.cast("uintptr_t", stream._ptr))
        ctypes.CDLL(portaudio._libname).PaAlsa_EnableRealtimeScheduling(ctypes.c_void_p(pointer), 1)
    except (AttributeError, OSError) as missing:
        logging.warning("the audio thread has no real-time priority: %s", missing)


def reported_latency_s(told_s: float, rate_Hz: int) -> float:
    """A stream's latency; 0 where PortAudio subtracted a block from a JACK port's 0 frames, in 32 bits without sign."""
    return told_s if told_s * rate_Hz < 2**31 else 0.0


def playable_rate(index: int, wished_Hz: int) -> int:
    """The wished rate, or the device's own when it does not do that (JACK has one rate for all).

    SinkError (3) when that is below the lowest of all.
    """
    try:
        sounddevice.check_output_settings(device=index, samplerate=wished_Hz, dtype="float32")
    except sounddevice.PortAudioError:
        facts = cast(dict[str, Any], sounddevice.query_devices(index))
        own_Hz = round(facts["default_samplerate"])
        if own_Hz < RATES_HZ[0]:
            raise SinkError(3, f"{facts['name']} plays at {own_Hz} Hz; {RATES_HZ[0]} Hz are needed") from None
        return own_Hz
    return wished_Hz
