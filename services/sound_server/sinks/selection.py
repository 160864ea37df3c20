"""From `--audio auto|null|wav:FILE|NAME` to a sink that plays, or one line that says why not."""

import logging
from pathlib import Path
from typing import Any

from sound_server.outputs import Outputs, channels_of
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.sink import Sink, SinkError
from sound_server.sinks.wavfile import WavFile

AUTO = "auto"
FALLBACK_FILE = "drumstick-roll.wav"


def _portaudio() -> Any:
    # sounddevice publishes no types. It raises OSError on import where the PortAudio library is missing.
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise SinkError(3, f"no audio library: {error}") from None
    return sounddevice


def _outputs(portaudio: Any) -> list[tuple[int, str, str]]:
    # (index, name, host API) of what can play.
    apis = [str(api["name"]) for api in portaudio.query_hostapis()]
    return [
        (index, str(device["name"]), apis[device["hostapi"]])
        for index, device in enumerate(portaudio.query_devices())
        if device["max_output_channels"] > 0
    ]


def _default_output(portaudio: Any, outputs: list[tuple[int, str, str]]) -> int:
    # A running JACK server is there to be used; asked by its host API's name, because at long periods PortAudio's own
    # default can be an ALSA device called "jack".
    for api in portaudio.query_hostapis():
        if "JACK" in api["name"] and api["default_output_device"] >= 0:
            return int(api["default_output_device"])
    index = int(portaudio.default.device[1])
    return index if index >= 0 else outputs[0][0]


def _opened(index: int, rate_Hz: int, block: int, outputs: Outputs = ()) -> Sink:
    import sounddevice

    from sound_server.sinks.device import DeviceSink

    try:
        return DeviceSink(index, rate_Hz, block, outputs)
    except sounddevice.PortAudioError as error:
        raise SinkError(3, f"the audio device does not open: {str(error).splitlines()[0]}") from None


def default_device(rate_Hz: int, block: int, outputs: Outputs = ()) -> Sink:
    """The default output device. SinkError (3) says why there is none."""
    portaudio = _portaudio()
    devices = _outputs(portaudio)
    if not devices:
        raise SinkError(3, "no audio output device")
    return _opened(_default_output(portaudio, devices), rate_Hz, block, outputs)


def labels() -> list[str]:
    """Every output device, as "name (host API)". SinkError (3) without an audio library."""
    return [f"{device} ({api})" for _, device, api in _outputs(_portaudio())]


def named_device(name: str, rate_Hz: int, block: int, outputs: Outputs = ()) -> Sink:
    """The first output device whose "name (host API)" contains `name`, upper or lower case. SinkError (3) if none."""
    devices, names = _outputs(_portaudio()), labels()
    for (index, _, _), label in zip(devices, names, strict=True):
        if name.lower() in label.lower():
            return _opened(index, rate_Hz, block, outputs)
    there = "; ".join(names) or "none"
    raise SinkError(3, f"no audio output device is called {name!r}; there are: {there}")


def wav(path: Path, rate_Hz: int, block: int, outputs: Outputs = ()) -> Sink:
    """A recording. SinkError (2) when the file cannot be written."""
    try:
        file = WavFile(path, rate_Hz, channels=channels_of(outputs))
    except OSError as error:
        raise SinkError(2, f"{path} cannot be written: {error.strerror}") from None
    return PacedSink(f"wav:{path}", rate_Hz, block, file.record, file.close, channels_of(outputs))


def _automatic(rate_Hz: int, block: int, outputs: Outputs = ()) -> Sink:
    try:
        return default_device(rate_Hz, block, outputs)
    except SinkError as error:
        if error.status == 2:
            raise
        reason = error
    try:
        sink = wav(Path(FALLBACK_FILE), rate_Hz, block, outputs)
    except SinkError as unwritable:
        logging.warning("%s, and %s: nothing will be heard", reason, unwritable)
        return PacedSink("null", rate_Hz, block, channels=channels_of(outputs))
    logging.info("%s: the sound goes into %s", reason, Path(FALLBACK_FILE).resolve())
    return sink


def open_sink(wish: str, rate_Hz: int, block: int, awaited: bool = False, outputs: Outputs = ()) -> Sink:
    """The sink for `--audio`. SinkError carries the exit status and one line. Main thread.

    `awaited`: the caller waits for a device that is not there, so `auto` puts no file in its place.
    """
    if wish == AUTO:
        return default_device(rate_Hz, block, outputs) if awaited else _automatic(rate_Hz, block, outputs)
    if wish == "null":
        return PacedSink("null", rate_Hz, block, channels=channels_of(outputs))
    if wish.startswith("wav:"):
        if wish == "wav:":
            raise SinkError(2, "wav: needs a file name, e.g. wav:roll.wav")
        return wav(Path(wish.removeprefix("wav:")), rate_Hz, block, outputs)
    return named_device(wish, rate_Hz, block, outputs)
