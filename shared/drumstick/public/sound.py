"""Sounds of a scene's drum: `strike`, `render`, and what it returns. Any thread; blocks while it computes."""

import base64
import struct
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.rates import DEFAULT_RATE_HZ, RATES_HZ
from drumstick.drum.render import render as rendered
from drumstick.parameters.scene import Scene, require_scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ONE_STRIKE_S = 0.05  # when the one strike falls that is played where nobody says which
_RINGS_S = 2.0  # after the last strike


class Blow(NamedTuple):
    """A strike at t_s (s) and (x, y) (in radii of the head, its centre is 0, 0), at speed_m_per_s (m/s) of the stick.

    >>> import drumstick as ds
    >>> [ds.strike(0.5 + 0.1 * i, 0.5, 0.0, t_s=0.25 * i) for i in range(4)][3].t_s
    0.75
    """

    t_s: float
    x: float
    y: float
    speed_m_per_s: float


class Played(Protocol):
    """A run that strikes a drum: `ds.Run` and `ds.ServoRun` do."""

    def drum_strikes(self) -> list[OfflineStrike]:
        """Blows for the drum of its scene."""
        ...


class Sound(np.ndarray[tuple[int, ...], np.dtype[np.float32]]):
    """Samples -1 .. 1, float32, shape (n, channels), with their rate_Hz: an array like any other. A notebook plays it.

    >>> import drumstick as ds
    >>> sound = ds.render(ds.scene("roll"), duration_s=0.5)
    >>> sound.shape, sound.dtype.name, sound.rate_Hz
    ((24000, 2), 'float32', 48000)
    """

    rate_Hz: int

    def __array_finalize__(self, obj: Any) -> None:
        self.rate_Hz = getattr(obj, "rate_Hz", DEFAULT_RATE_HZ)

    def wav(self) -> bytes:
        """Contents of a WAV file, 16 bit. Raises ValueError unless the shape is (n,) or (n, channels)."""
        if self.ndim not in (1, 2):
            raise ValueError(f"a sound has the shape (n,) or (n, channels), not {self.shape}")
        channels = 1 if self.ndim == 1 else self.shape[1]
        data = np.rint(32767.0 * np.clip(np.asarray(self), -1.0, 1.0)).astype("<i2").tobytes()
        frame = 2 * channels
        form = (1, channels, self.rate_Hz, frame * self.rate_Hz, frame, 16)  # 1: whole numbers
        sizes = 36 + len(data), b"WAVE", b"fmt ", 16, *form, b"data", len(data)
        return struct.pack("<4sI4s4sIHHIIHH4sI", b"RIFF", *sizes) + data

    def plot(self) -> "Figure":
        """Its samples over time, drawn by matplotlib."""
        from drumstick.public.plots import over_time

        return over_time("", np.arange(len(self)) / self.rate_Hz, {"sample": np.asarray(self)})

    def _repr_html_(self) -> str:
        return f'<audio controls src="data:audio/wav;base64,{base64.b64encode(self.wav()).decode()}"></audio>'


def strike(speed_m_per_s: float, x: float = 0.5, y: float = 0.0, t_s: float = 0.0) -> Blow:
    """One blow on a drum, for `render`: the stick's speed (m/s), where (in radii), and when (s).

    >>> import drumstick as ds
    >>> quarters = [ds.strike(2.0, t_s=0.5 * beat) for beat in range(4)]
    >>> ds.render(ds.scene("roll"), quarters).shape
    (168000, 2)
    """
    return Blow(t_s, x, y, speed_m_per_s)


def strikes_of(scene: Scene, run: Played | Blow | Iterable[Blow] | None) -> list[OfflineStrike]:
    """Blows on the scene's drum; of None one stroke at half the full-scale speed, at half radius."""
    if run is None:
        run = strike(scene.strike.full_scale_m_per_s / 2.0, t_s=_ONE_STRIKE_S)
    if isinstance(run, Blow):
        run = [run]
    if isinstance(run, Iterable):
        return [strike_for_speed(scene, blow.speed_m_per_s, blow.x, blow.y, blow.t_s) for blow in run]
    return run.drum_strikes()


def render(
    scene: Scene,
    run: Played | Blow | Iterable[Blow] | None = None,
    rate_Hz: int = DEFAULT_RATE_HZ,
    duration_s: float | None = None,
    neighbours: np.ndarray[tuple[int, ...], np.dtype[np.float32]] | None = None,
) -> Sound:
    """Sound of the scene's drum, float32 of shape (n, 2), by the very code that plays live.

    run: a run of a stick, one blow or several (`ds.strike`); None: one stroke at half radius. rate_Hz: 22050 .. 192000.
    duration_s: None: until 2 s after the last strike. The drum is `scene`'s, a run may be another scene's. A scene
    with [drum] excitation = "streamed" is played by the pulses of its strikes; `drumstick render --roll` plays it by
    every force. neighbours: sound of other drums, shape (n, 2), that a drum with the effect `sympathy` hears; it is not
    in what comes back. Output level, mesh and modes: docs/mesh.md, docs/sounds.md.

    Raises Unplayable where the drum's effects leave no wave any room, or scipy is missing; ValueError for a rate or a
    time outside its range.

    >>> import drumstick as ds
    >>> scene = ds.scene("roll")
    >>> ds.render(scene, ds.simulate(scene, 1.0), duration_s=1.0).shape
    (48000, 2)
    """
    require_scene(scene)
    if not RATES_HZ[0] <= rate_Hz <= RATES_HZ[1]:
        raise ValueError(f"a rate of {rate_Hz} Hz is outside {RATES_HZ[0]} .. {RATES_HZ[1]} Hz")
    strikes = strikes_of(scene, run)
    if duration_s is None:
        duration_s = max((blow.t_s for blow in strikes), default=0.0) + _RINGS_S
    if not 0.0 < duration_s < 1e5:
        raise ValueError(f"a duration of {duration_s:g} s: give one above 0 s and below a day")
    sound = rendered(scene, strikes, duration_s, rate_Hz, neighbours=neighbours).view(Sound)
    sound.rate_Hz = rate_Hz
    return sound
