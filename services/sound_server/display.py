"""One drum shown to whoever looks: its surface, its spectrum, its cost, each only while somebody subscribes.

Runs on a thread of its own; while nobody subscribes it asks Zenoh five times a second whether anybody does. The audio
thread is told what to copy (drumstick.drum.output.display_data) and never waits.
"""

import logging
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import zenoh

from drumstick.drum import estimate
from drumstick.drum.engine import Engine
from drumstick.drum.length_unit import metres_per_unit
from drumstick.drum.membrane.surface import RINGS, SPOKES
from drumstick.drum.modal.surface import of_modes
from drumstick.drum.output.display_data import (
    FRAMES_PER_S,
    SOUND_SAMPLES,
    last_heard,
    request_display,
    take_surface,
)
from drumstick.parameters.scene import Scene
from protocol import messages
from protocol.keys import Keys
from realtime.stop import StopRequest

_POLL_S = 0.2
_SPECTRUM_S, _COST_S = 0.25, 1.0
_WINDOW = SOUND_SAMPLES // 2
_TOP = 8.0  # of the spectrum, to the pitch of the lowest mode
_MAX_LEVELS = 400
_FLOOR_dB = -120.0

Numbers = npt.NDArray[np.float64]


def spectrum(sound: npt.NDArray[np.float32], rate_Hz: float, top_Hz: float) -> Numbers:
    """Levels in dB, 0 for a sine of full scale, in at most 400 equal steps up to top_Hz. sound: shape (16384,)."""
    window = np.hanning(len(sound))
    amplitude = 2.0 * np.abs(np.fft.rfft(sound * window)) / window.sum()
    bins = amplitude[: max(2, round(top_Hz * len(sound) / rate_Hz) + 1)]
    starts = np.linspace(0, len(bins), min(len(bins), _MAX_LEVELS), endpoint=False).astype(int)
    loudest = np.maximum.reduceat(bins, starts)
    return np.maximum(20.0 * np.log10(np.maximum(loudest, 1e-30)), _FLOOR_dB)


def in_sixteen_bits(heights: Numbers) -> tuple[float, bytes]:
    """A unit, and the heights as whole numbers of it: int16, little-endian."""
    unit = float(np.abs(heights).max()) / 32767.0
    return unit, (np.round(heights / unit) if unit > 0.0 else 0.0 * heights).astype("<i2").tobytes()


class _Drum(NamedTuple):
    scene: Scene
    engine: Engine
    words: str
    shapes: Numbers | None
    metres: float


class DrumDisplay:
    """Display of one rig's drum. `show` belongs to the drum's thread; `run` is the body of the viewing thread."""

    def __init__(
        self, publisher: Callable[[str], zenoh.Publisher], keys: Keys, ident: str, clock: Callable[[int], int]
    ) -> None:
        """`clock` maps this machine's monotonic ns to the haptic machine's."""
        self._publisher, self._keys, self._id, self._clock = publisher, keys, ident, clock
        self._lock = threading.Lock()
        self._drum: _Drum | None = None

    def show(self, scene: Scene, engine: Engine, words: str) -> None:
        """Display this drum from now on; `words` say what renders it."""
        shapes = None
        if scene.modal is not None:
            from drumstick.drum.modal.building import highest_zero

            control: Any = engine.control[0]
            highest = highest_zero(scene, control["rate_Hz"] / control["divisor"])
            shapes = of_modes(highest, scene.drum).shapes
        with self._lock:
            if self._drum is not None:
                request_display(self._drum.engine.shown, surface=False, sound=False)
            self._drum = _Drum(scene, engine, words, shapes, metres_per_unit(scene))

    def go_on_with(self, engine: Engine, before: Engine) -> None:
        """Display this copy of the engine before from now on, if that is displayed. Any thread."""
        with self._lock:
            # Another drum's shapes do not fit: one that has just entered may not be displayed yet.
            if self._drum is not None and self._drum.engine is before:
                request_display(self._drum.engine.shown, surface=False, sound=False)
                self._drum = self._drum._replace(engine=engine)

    def run(self, stop: StopRequest) -> None:
        """Put what is looked at, until `stop`."""
        membrane, spectra, costs = (
            self._publisher(key) for key in (self._keys.membrane, self._keys.spectrum, self._keys.cost)
        )
        next_spectrum = next_cost = 0.0
        pause_s = _POLL_S
        while not stop.wait(pause_s):
            now = time.monotonic()
            try:
                surface, sound, cost = (_is_watched(each) for each in (membrane, spectra, costs))
                pause_s = 1.0 / FRAMES_PER_S if surface else _POLL_S
                with self._lock:
                    drum = self._drum
                    if drum is None:
                        continue
                    request_display(drum.engine.shown, surface, sound)
                    if surface:
                        self._put_surface(membrane, drum)
                    if sound and now >= next_spectrum:
                        next_spectrum = now + _SPECTRUM_S
                        spectra.put(messages.encode(self._spectrum(drum)))
                    if cost and now >= next_cost:
                        next_cost = now + _COST_S
                        for row in self._costs(drum):
                            costs.put(messages.encode(row))
            except zenoh.ZError as error:
                if stop.is_set():
                    return
                logging.warning("not shown: %s", error)

    def _now_ns(self) -> int:
        return self._clock(time.monotonic_ns())

    def _put_surface(self, publisher: zenoh.Publisher, drum: _Drum) -> None:
        values = take_surface(drum.engine.shown)
        if values is None:
            return
        heights = values.astype(np.float64) if drum.shapes is None else drum.shapes @ values
        unit, in_units = in_sixteen_bits(drum.metres * heights)
        publisher.put(
            messages.encode(
                messages.Membrane(
                    id=self._id,
                    t_ns=self._now_ns(),
                    rings=RINGS,
                    spokes=SPOKES,
                    unit_m=unit,
                    heights=in_units,
                )
            )
        )

    def _spectrum(self, drum: _Drum) -> messages.Spectrum:
        rate_Hz = float(drum.engine.control["rate_Hz"][0])
        top_Hz = min(_TOP * drum.scene.drum.f01_Hz, rate_Hz / 2.0)
        levels = spectrum(last_heard(drum.engine.shown, _WINDOW), rate_Hz, top_Hz)
        return messages.Spectrum(
            id=self._id,
            t_ns=self._now_ns(),
            top_Hz=top_Hz,
            window_s=_WINDOW / rate_Hz,
            levels=levels.astype("<f4").tobytes(),
        )

    def _costs(self, drum: _Drum) -> list[messages.Cost]:
        control: Any = drum.engine.control[0]
        rate_Hz = round(float(control["rate_Hz"]))
        found = estimate.estimates(drum.scene, rate_Hz)
        if drum.scene.modal is not None:
            found = [estimate.Estimate("now", rate_Hz / int(control["divisor"]), 0.0, 1.0, 0.0)]
        return [
            messages.Cost(
                id=self._id,
                words=drum.words,
                accuracy=each.accuracy,
                mesh_rate_Hz=each.mesh_rate_Hz,
                across=each.across,
                share=each.updates_per_s / found[0].updates_per_s,
                cents=each.cents,
            )
            for each in found
        ]


def _is_watched(publisher: zenoh.Publisher) -> bool:
    status: Any = publisher.matching_status  # zenoh's own annotation says bool, which it is not
    matching: bool = status.matching
    return matching
