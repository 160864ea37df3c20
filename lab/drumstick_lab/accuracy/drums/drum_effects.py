"""Cost of each effect of a mesh per sample, and the change it makes in the sound. Any thread; blocks for seconds.

Alone on the default drum; `snare` needs a second head to lie on, and is compared with `cavity`. The change is the level
of the difference of two spectrograms, with the effect and without, relative to the one with: magnitudes only, for the
phases of two heads drift apart by the slightest detuning, which is not heard.
"""

import dataclasses
import math
import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.build import size_of
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS, NEEDS
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.heads import DEVICE_RATE_Hz, sounding
from drumstick_lab.accuracy.timing import ENGINES, SWEEP, Window, apart, in_turn, plain_sweep

ALL, NONE = "all", "none"
QUICK = ("uniform_loss", "internal_loss", "tension", "cavity")  # the rest would compile for a minute more
_HEARD_S = 1.2
_WINDOW = 2048  # samples, 43 ms
Sound = npt.NDArray[np.float32]


def drum_with(*effects: str) -> Scene:
    """The default drum with these, as they are by default."""
    plain = Scene("drum")
    tables = {name: DRUM_TABLES[name]() for name in MESH_EFFECTS if name in effects}
    return dataclasses.replace(plain, drum=dataclasses.replace(plain.drum, effects=tables))


def _named(effect: str) -> tuple[str, ...]:
    if effect in (ALL, NONE):
        return MESH_EFFECTS if effect == ALL else ()
    return (*needed(effect), effect)


def scene_of(effect: str) -> Scene:
    """The default drum with this effect and what it needs, with ALL or with NONE."""
    return drum_with(*_named(effect))


def needed(effect: str) -> tuple[str, ...]:
    """The effect without which this one cannot be, if there is one."""
    return NEEDS[effect][:1] if effect in NEEDS else ()


def without(effect: str) -> str:
    """Table with which an effect is compared."""
    return next(iter(needed(effect)), NONE)


def _blows(scene: Scene) -> list[OfflineStrike]:
    # One of full scale at half radius, then one on the rim.
    speed = scene.strike.full_scale_m_per_s
    return [
        strike_for_speed(scene, speed, 0.5, 0.0, 0.0),
        strike_for_speed(scene, speed, 0.97, 0.0, 0.5 * _HEARD_S),
    ]


def heard(effect: str) -> Sound:
    """Two blows on the drum with it, as the product plays them; (n, 2)."""
    scene = scene_of(effect)
    return render(scene, _blows(scene), _HEARD_S, DEVICE_RATE_Hz)


def _spectrogram(sound: Sound) -> npt.NDArray[np.float64]:
    parts = np.lib.stride_tricks.sliding_window_view(sound, _WINDOW, axis=0)[:: _WINDOW // 2]
    return np.abs(np.fft.rfft(parts * np.hanning(_WINDOW), axis=-1))


def changes(with_it: Sound, without_it: Sound) -> float | None:
    """The level of what differs, dB of the sound with the effect; None where nothing does."""
    wanted, other = _spectrogram(with_it), _spectrogram(without_it)
    ratio = float(np.linalg.norm(wanted - other) / np.linalg.norm(wanted))
    return 20.0 * math.log10(ratio) if ratio > 0.0 else None


def _window(effect: str) -> Window:
    scene, strikes = scene_of(effect), StrikeRing()
    engine = build(scene, DEVICE_RATE_Hz, strikes)
    divisor = int(engine.control["divisor"][0])
    return sounding(scene, engine, strikes, size_of(engine) / divisor)


def sample_rows(effects: Sequence[str], rounds: int) -> tuple[list[dict[str, Any]], float]:
    """One row each, those with nothing and with everything at the ends, all timed in the same rounds; ns of SWEEP.

    What is added is the median over engines, `spread_ns` half of what they span.
    """
    besides = {without(effect) for effect in effects} - {NONE, *effects}
    names = [NONE, *effects, *sorted(besides), ALL]
    windows = {f"{name} {k}": _window(name) for k in range(ENGINES) for name in names}
    times = in_turn({SWEEP: plain_sweep()} | windows, rounds)
    each = {name: [times[f"{name} {k}"] for k in range(ENGINES)] for name in names}
    ns = {name: statistics.median(values) for name, values in each.items()}
    added = {name: apart(each[name], each[without(name)]) for name in names}
    sounds = {name: heard(name) for name in names}
    rows: list[dict[str, Any]] = [
        {
            "effect": name,
            "ns_per_sample": ns[name],
            "added_ns": added[name][0],
            "spread_ns": added[name][1],
            "ratio": ns[name] / times[SWEEP],
            "changes_dB": None if name == NONE else changes(sounds[name], sounds[without(name)]),
        }
        for name in names
    ]
    return rows, times[SWEEP]
