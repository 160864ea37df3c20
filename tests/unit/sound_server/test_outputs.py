"""Output pairs: as they are written, and where each sound leaves the mixer."""

import re

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.calibrate import build
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from sound_server.mixer import Mixer, mix
from sound_server.outputs import channel_names, channels_of, of_rig, outputs_of

RATE = 48_000
BLOCK = 128
TEXT = "left-drum=1-2, right-drum=4-3,right-drum/pickup-2=5-6,other=1-2"


def test_a_map_is_read_as_it_is_written() -> None:
    outputs = outputs_of(TEXT)
    assert [(pair.name, pair.left, pair.right) for pair in outputs] == [
        ("left-drum", 1, 2),
        ("right-drum", 4, 3),
        ("right-drum/pickup-2", 5, 6),
        ("other", 1, 2),
    ]
    assert channels_of(outputs) == 6
    assert channel_names(outputs)[:4] == [
        "left-drum.left+other.left",
        "left-drum.right+other.right",
        "right-drum.right",
        "right-drum.left",
    ]
    assert of_rig(outputs, "right-drum") == ((3, 2), {"pickup-2": (4, 5)})
    assert of_rig(outputs, "unnamed") == ((0, 1), {})


def test_channels_that_nobody_has_keep_a_number() -> None:
    assert channel_names(outputs_of("a=1-4"))[1:3] == ["channel-2", "channel-3"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "write RIG=1-2, or RIG/microphone-1=3-4"),
        ("drum", "'drum': write RIG=1-2"),
        ("drum=1", "'drum=1': write RIG=1-2"),
        ("drum=1-2,", "'': write RIG=1-2"),
        ("drum=1-2-3", "write RIG=1-2"),
        ("d rum=1-2", "rig name 'd rum'"),
        ("drum/overhead=1-2", "after the / comes pickup-1"),
        ("drum/pickup-0=1-2", "after the / comes pickup-1"),
        ("drum/pickup-17=1-2", "after the / comes pickup-1"),
        ("drum/=1-2", "after the / comes pickup-1"),
    ],
)
def test_what_is_no_map_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        outputs_of(text)


def struck(f01_Hz: float, apart: tuple[str, ...] = ()) -> Engine:
    ring = StrikeRing()
    engine = build(Scene("drum", drum=Drum(f01_Hz=f01_Hz)), RATE, ring, apart)
    ring.push(0, 0.3, 0.1, 2.0, 0.004)
    return engine


def played(mixer: Mixer, channels: int, frames: int = 2048) -> npt.NDArray[np.float32]:
    out = np.zeros((frames, channels), np.float32)
    for start in range(0, frames, BLOCK):
        mix(mixer.buffers, out[start : start + BLOCK], RATE, int(start * 1e9 / RATE))
    return out


def test_each_drum_and_each_pickup_leaves_by_its_own_pair_and_the_sum_is_the_mix() -> None:
    stereo = Mixer(RATE)
    wide = Mixer(RATE, 6)
    for mixer, apart in ((stereo, ()), (wide, ("pickup-2",))):
        pairs = [(0, 1)] if mixer is stereo else [(3, 2), (4, 5)]
        mixer.enter(struck(150.0))
        mixer.enter(struck(210.0, apart), pairs)
    both, apart_sound = played(stereo, 2), played(wide, 6)
    lone = Mixer(RATE)
    lone.enter(struck(150.0))
    assert np.array_equal(apart_sound[:, :2], played(lone, 2))
    loudest = np.abs(apart_sound).max(axis=0)
    assert (loudest > 0.01).all(), "each channel has its sound"
    assert loudest[3] > 1.1 * loudest[2], "the pickup on the left is left, on a pair that is written 4-3"
    assert loudest[5] > 1.1 * loudest[4]
    left, right = apart_sound[:, [0, 3, 4]].sum(axis=1), apart_sound[:, [1, 2, 5]].sum(axis=1)
    assert np.abs(both).max() < 0.75  # the limiter changes nothing
    assert np.stack([left, right], axis=1) == pytest.approx(both, abs=1e-6)


def test_a_drum_with_stems_leaves_without_a_click_as_any_other() -> None:
    mixer = Mixer(RATE, 4)
    at = mixer.enter(struck(150.0, ("pickup-1",)), [(0, 1), (2, 3)])
    assert np.abs(played(mixer, 4)).max(axis=0).min() > 0.01
    mixer.leave(at)
    assert not played(mixer, 4, 4096)[round(0.061 * RATE) + BLOCK :].any()
    assert mixer.has_left(at)


def test_pairs_that_do_not_fit_are_refused() -> None:
    mixer, engine = Mixer(RATE, 4), struck(150.0)
    for pairs in ([(0, 1), (2, 3)], [(3, 4)]):
        with pytest.raises(ValueError, match="do not fit"):
            mixer.enter(engine, pairs)
    assert mixer.drums == 0
