"""Another drum in every block: another tuning, another level, another type of engine, again and again."""

import dataclasses
import math

import numpy as np
import pytest

from drumstick.drum.calibrate import build
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from sound_server.mixer import GONE, Mixer, mix
from stability.catalogue import shows
from stability.mesh_steps import RATE, drum_of, engine_of, height, strike, take

BLOCK, BLOCKS = 512, 30
TUNINGS = ((600.0, -20.0, {}), (430.0, 0.0, {"tension": TensionTable(300.0)}), (910.0, 12.0, {}))


def _drum(block: int) -> Engine:
    # Struck in the middle of the block with which it comes.
    f01_Hz, gain_dB, effects = TUNINGS[block % len(TUNINGS)]
    scene = drum_of(effects, t60_s=1.0, f01_Hz=f01_Hz)
    scene = dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, gain_dB=gain_dB))
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    ring.push(round((block + 0.5) * BLOCK * 1e9 / RATE), 0.3, 0.1, 2.0, 0.004)
    return engine


def _changed_in_each_block(cut: bool) -> np.ndarray:
    mixer, out, place = Mixer(RATE), np.zeros((BLOCKS * BLOCK, 2), np.float32), -1
    for block in range(BLOCKS):
        coming = mixer.enter(_drum(block))
        if place >= 0 and cut:
            mixer.buffers.states[place] = GONE
        elif place >= 0:
            mixer.leave(place)
        place = coming
        first = block * BLOCK
        mix(mixer.buffers, out[first : first + BLOCK], RATE, int(first * 1e9 / RATE))
    return out


def _jumps(sound: np.ndarray) -> np.ndarray:
    # The third difference shows a jump, in the sound or in its slope: where one drum follows another, and elsewhere.
    rough = np.abs(np.diff(sound[:, 0].astype(float), n=3))
    return np.array([rough[at - 4 : at + 1].max() for at in range(2 * BLOCK, len(sound), BLOCK)])


@pytest.mark.long
@shows("another drum in every block")
def test_another_drum_in_every_block_neither_clicks_nor_overflows() -> None:
    """Dropping the one before in mid-sound clicks; over all of them, as one may be cut just as it passes 0."""
    faded, cut = _changed_in_each_block(cut=False), _changed_in_each_block(cut=True)
    assert np.abs(faded).max() <= 1.0
    assert np.abs(faded).max() > 0.05
    assert math.sqrt(np.mean(_jumps(cut) ** 2)) > 3.0 * math.sqrt(np.mean(_jumps(faded) ** 2))
    assert _jumps(faded).max() < 0.5 * _jumps(cut).max()


@shows("another drum in every block", "naive")
def test_a_ringing_head_that_is_tuned_in_place_is_pumped_up() -> None:
    """Up and down by half an octave, every 37 steps: each change multiplies what is bent just then."""
    engine = engine_of(drum_of({}))
    strike(engine, 1.0)
    take(engine, 20)
    first, tau = height(engine), float(engine.control["tau"][0])
    weights = engine.head.weights.copy()
    changes = 0
    while changes < 200 and height(engine) < 1e6 * first:
        changes += 1
        share = 0.5 if changes % 2 else 1.0
        engine.head.weights[:] = np.float32(share) * weights
        engine.control["u_gain"] = 2.0 - share * tau
        take(engine, 37)
    assert height(engine) >= 1e6 * first
