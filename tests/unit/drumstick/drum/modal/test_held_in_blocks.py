"""A muffle that glides on a bank, in audio blocks of any length: the same bits from the sample at which it woke.

Its moves are counted in steps, and a drum that sleeps takes none: they are counted from the begin of the block into
which the first strike falls. So that block's begin, and nothing else of the division, moves them, by less than
PRESS_STEPS steps.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.memory.bank import PRESS_STEPS
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import with_mallet

RATE = 48_000
EPOCH_NS = 10**9
FRAMES = 7200
FIRST = 100.3  # the first strike, in samples
STROKES = {2100: (2.0, -0.5, 0.3), 3000: (4.0, 0.1, -0.6), 3150: (3.0, 0.7, 0.0)}  # speed and place; at once
SETS = {2000: 1.0, 4700: 0.2}
HEARD_S = 0.025
POLYESTER = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=1200.0)
Floats = npt.NDArray[np.float32]


def _scene(top_Hz: float, **effects: Any) -> Scene:
    drum = Drum(f01_Hz=150.0, radius_m=0.17, effects=effects | {"muffle": MuffleTable(press=0.0)})
    return Scene("bank", drum=drum, modal=Modal(top_Hz))


def _under_tension() -> Scene:
    scene = _scene(6000.0, tension=POLYESTER, air=AirTable(1.2, 0.26, "none"))
    return dataclasses.replace(scene, listen=Listen(microphones=((-0.5, 0.6, 0.5, -0.6),)))


SCENES = {
    "pulses": _scene(5000.0),
    "pulses under tension": _under_tension(),
    "mallets": with_mallet(_scene(5000.0)),
    "mallets under tension": with_mallet(_under_tension()),
}


# Cold, a pulse's kernels under a tension are compiled for some seconds, for what a mallet's test too.
NAMES = [
    pytest.param(name, marks=pytest.mark.long) if name == "pulses under tension" else name for name in SCENES
]
_BLOCK = 110  # the first strike falls into one that begins where the blocks do, up to a few samples before it


def _engine(scene: Scene, first: float) -> tuple[Engine, StrikeRing]:
    ring = StrikeRing()
    engine = new_engine(scene, RATE, ring)
    ring.push_blow(strike_for_speed(scene, 3.0, 0.3, 0.2), EPOCH_NS + round(first * 1e9 / RATE))
    return engine, ring


def _press(engine: Engine) -> float:
    return float(engine.effects.muffle.state["press"][0])


def _rendered(
    scene: Scene,
    cuts: Iterable[int],
    first: float = FIRST,
    strokes: Mapping[int, tuple[float, float, float]] = STROKES,
    frames: int = FRAMES,
) -> tuple[Floats, int]:
    # Cut at these samples, and wherever something is set or struck; also at which sample the first set was reached.
    (engine, ring), out, reached = _engine(scene, first), np.zeros((frames, 2), np.float32), frames
    borders = sorted({0, frames, *strokes, *SETS, *(cut for cut in cuts if cut < frames)})
    for begin, end in itertools.pairwise(borders):
        if begin in SETS:
            set_live(engine, "muffle", SETS[begin])
        if begin in strokes:
            ring.push_blow(strike_for_speed(scene, *strokes[begin]))
        render_all(engine, out[begin:end], end - begin, EPOCH_NS + round(begin * 1e9 / RATE))
        if _press(engine) == 1.0:
            reached = min(reached, end)
    assert _press(engine) == SETS[max(SETS)]
    return out, reached


def _difference(one: Floats, other: Floats) -> float:
    # The largest, over the other's largest sample, dB.
    return 20.0 * math.log10(max(float(np.abs(one - other).max() / np.abs(other).max()), 1e-12))


def _levels(sound: Floats) -> npt.NDArray[np.float64]:
    # Of every 25 ms, dB.
    power = sound.astype(float).reshape(-1, round(HEARD_S * RATE), 2) ** 2
    return 10.0 * np.log10(power.mean(axis=(1, 2)) + 1e-30)


@functools.cache
def _whole(name: str) -> Floats:
    sound, _ = _rendered(SCENES[name], ())
    assert np.abs(sound).max() > 0.0
    return sound


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=6)
@given(lengths=st.lists(st.integers(1, 900), min_size=20, max_size=60))
def test_the_same_bits_however_it_is_cut(name: str, lengths: list[int]) -> None:
    """Woken by the same block, which begins at 0: all that comes after it may be cut anywhere."""
    cuts = itertools.accumulate(lengths, initial=math.ceil(FIRST))
    np.testing.assert_array_equal(_rendered(SCENES[name], cuts)[0], _whole(name))


@pytest.mark.parametrize("name", NAMES)
def test_waking_a_whole_number_of_moves_later_makes_no_difference(name: str) -> None:
    """The steps between would have moved nothing. To rounding: a strike's instant is in nanoseconds."""
    scene = SCENES[name]
    later = 2 * PRESS_STEPS * int(_engine(scene, FIRST)[0].control["divisor"][0])
    at_once, woken = (_rendered(scene, cuts, later + FIRST, {}, 8400)[0] for cuts in ([], [later]))
    assert _difference(woken, at_once) < -90.0


@pytest.mark.parametrize("name", NAMES)
def test_the_begin_of_the_first_strikes_block_moves_the_hand_by_less_than_one_move(name: str) -> None:
    """No sample is another until then, but for rounding, and nobody hears it after: levels of 25 ms within 0.5 dB."""
    scene = SCENES[name]
    move = PRESS_STEPS * int(_engine(scene, FIRST)[0].control["divisor"][0])
    begins = (0, 1, 37, 64, 91)
    found = [_rendered(scene, range(begin, FRAMES, _BLOCK), strokes={}) for begin in begins]
    sounds, reached = [sound for sound, _ in found], [at for _, at in found]
    assert max(reached) - min(reached) < move + _BLOCK
    for sound in sounds[1:]:
        assert _difference(sound[: min(SETS)], sounds[0][: min(SETS)]) < -100.0
        assert np.abs(_levels(sound) - _levels(sounds[0])).max() < 0.5
