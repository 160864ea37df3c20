"""A bank under tension that rings in blocks, against the same bank step by step: pitch, levels and energy."""

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.bank import CELL, TILE
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.apart import mean_stretch
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import in_bank, start_mallet, with_mallet
from realtime.records import is_there

RATE = 48_000
POLYESTER = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=1200.0)
HARDEST_M_PER_S = 25.0
Numbers = npt.NDArray[np.float64]


@functools.cache
def _scene(rings_for_ever: bool, top_Hz: float = 6000.0) -> Scene:
    losses = {} if rings_for_ever else {"internal_loss": InternalLossTable(0.5, 3000.0)}
    t60_s = math.inf if rings_for_ever else 1.0
    drum = Drum(f01_Hz=100.0, radius_m=0.2, t60_s=t60_s, effects={"tension": POLYESTER, **losses})
    listen = Listen(microphones=((-0.5, 0.6, 0.5, -0.6), (0.6, 0.5, 0.5, 0.6)))
    return with_mallet(Scene("bank", drum=drum, modal=Modal(top_Hz), listen=listen))


def _engine(scene: Scene, in_blocks: bool = True) -> Engine:
    engine = new_engine(scene, RATE, StrikeRing())
    return engine if in_blocks else engine._replace(blocks=None)


def _take(engine: Engine, steps: int) -> npt.NDArray[np.float32]:
    out = np.zeros((steps * int(engine.control["divisor"][0]), 2), np.float32)
    render_all(engine, out, len(out), 0)
    return out


def _pull(engine: Engine) -> float:
    return float(engine.effects.tension.state["pull"][0])


def _play_to_the_end_of_a_cell(engine: Engine) -> None:
    # Until no mallet plays; to where all modes have taken as many steps as were handed out.
    while engine.mallets.state["begun"][0] != engine.mallets.state["oldest"][0]:
        _take(engine, 1)
    _take(engine, CELL - int(engine.control["steps"][0]) % CELL)


def _ringing(engine: Engine, cells: int) -> tuple[Numbers, float]:
    # Energy at the end of each cell, over that before the first; and the largest pull.
    first, most, found = in_bank(engine), 0.0, np.zeros(cells)
    for n in range(cells):
        _take(engine, CELL)
        found[n] = in_bank(engine) / first
        most = max(most, _pull(engine))
    return found, most


def test_a_bank_under_tension_rings_in_blocks_but_for_its_lowest_modes() -> None:
    engine = _engine(_scene(False))
    state = engine.blocks.state[0]
    assert 192 <= int(state["lowest"]) < 192 + TILE
    assert (len(engine.modal.orders) - int(state["lowest"])) % TILE == 0
    start_mallet(engine, 3.0)
    _take(engine, 1)
    while engine.mallets.state["begun"][0] != engine.mallets.state["oldest"][0]:
        assert (state["steps"], state["apart"]) == (0, 0)
        _take(engine, 1)
    _play_to_the_end_of_a_cell(engine)
    _take(engine, CELL)
    assert (state["steps"], state["apart"]) == (CELL, 1)
    start_mallet(engine, 3.0)
    _take(engine, 1)
    assert state["apart"] == 0


def test_a_small_bank_under_tension_goes_step_by_step() -> None:
    assert not is_there(_engine(_scene(False, 1500.0)).blocks)


class _Heard(NamedTuple):
    rises: Numbers
    sound: Numbers


def _heard(in_blocks: bool, speed: float, x: float) -> _Heard:
    # Of half a second after a stroke: the rise of the tension in each sample, and one channel.
    engine = _engine(_scene(False), in_blocks)
    start_mallet(engine, speed, x, 0.0)
    sound, rises = np.zeros(RATE // 2), np.zeros(RATE // 2)
    divisor = int(engine.control["divisor"][0])
    for n in range(0, len(sound), divisor):
        sound[n : n + divisor] = _take(engine, 1)[:, 0]
        rises[n : n + divisor] = _pull(engine)
    return _Heard(rises, sound)


def _octave_levels(sound: Numbers) -> Numbers:
    # By octave from 63 Hz, of every 50 ms.
    windows = sound.reshape(-1, RATE // 20) * np.hanning(RATE // 20)
    power, f_Hz = np.abs(np.fft.rfft(windows)) ** 2, np.fft.rfftfreq(RATE // 20, 1.0 / RATE)
    edges = 63.0 * 2.0 ** (np.arange(8) - 0.5)
    bands = [power[:, (f_Hz >= a) & (f_Hz < b)].sum(axis=1) for a, b in itertools.pairwise(edges)]
    return 10.0 * np.log10(np.array(bands))


@pytest.mark.parametrize("x", [0.5, 0.95])
def test_it_sounds_as_step_by_step(x: float) -> None:
    """The hardest stroke: the pitch of any period within a cent, octaves of any 50 ms within 0.3 dB."""
    ours, witness = (_heard(in_blocks, HARDEST_M_PER_S, x) for in_blocks in (True, False))
    assert witness.rises.max() > 0.3
    period = RATE // 100
    cents = [600.0 * np.log2(1.0 + heard.rises.reshape(-1, period).mean(axis=1)) for heard in (ours, witness)]
    assert np.abs(cents[0] - cents[1]).max() < 1.0
    levels = [_octave_levels(heard.sound) for heard in (ours, witness)]
    heard = levels[1] > levels[1].max() - 70.0
    assert np.abs(levels[0] - levels[1])[heard].max() < 0.3


def test_no_hard_stroke_of_many_leaves_a_drum_that_gains() -> None:
    """Without any loss: what the mean comes late by takes a little of the energy, and gives none."""
    engine, chance = _engine(_scene(True)), np.random.default_rng(2)
    pulls: list[float] = []
    for _ in range(6):
        start_mallet(engine, float(chance.uniform(5.0, HARDEST_M_PER_S)), *chance.uniform(-0.9, 0.9, 2))
        _take(engine, 1)
        _play_to_the_end_of_a_cell(engine)
        energies, most = _ringing(engine, 200)
        assert engine.blocks.state["apart"][0] == 1
        pulls.append(most)
        assert energies.max() < 1.0 + 2e-6
        assert np.diff(energies, prepend=1.0).max() < 2e-5
        assert energies[-1] > 0.98
    assert max(pulls) > 0.5


@pytest.mark.parametrize("rise", [0.1, 0.8])
def test_nor_does_one_whose_high_modes_alone_ring(rise: float) -> None:
    """All the stretch comes late here, by its mean. What energy is off by then is noticed, and nothing is gained."""
    engine, chance = _engine(_scene(True)), np.random.default_rng(3)
    modes, tight = engine.modal, engine.effects.tension.state
    lowest, count = int(engine.blocks.state["lowest"][0]), len(modes.orders)
    for first, last in ((lowest, count), (count + lowest, 2 * count)):
        modes.q[first:last] = chance.standard_normal(last - first) / np.sqrt(
            modes.stretch_weights[first:last]
        )
    stretched = 0.5 * float(np.sum(modes.stretch_weights * modes.q.astype(float) ** 2))
    modes.q[:] *= np.float32(math.sqrt(rise / float(tight["kappa"][0]) / stretched))
    engine.control["asleep"], engine.control["loudest"] = 0, float(np.abs(modes.q).max())
    _take(engine, CELL)
    energies, most = _ringing(engine, 1000)
    assert most == pytest.approx(rise, rel=0.5)
    assert energies.max() < 1.0 + 2e-4
    assert energies.min() > 0.99


def test_the_mean_of_a_mode_is_that_of_its_products_and_knows_no_phase() -> None:
    """One mode at a time, turned by hand in double precision under a constant pull."""
    engine = _engine(_scene(True))
    modes, pull = engine.modal, 0.6
    for at in (0, 40, 300, len(modes.orders) - 1):
        own = float(modes.stiffness[at] + pull * modes.r_squared[at] * modes.tension_stiffness[at])
        weight, q, d = float(modes.stretch_weights[at]), 1.0, 0.0
        products, means = list[float](), list[float]()
        for _ in range(4000):
            modes.q[at], modes.d[at] = q, d
            means.append(mean_stretch(modes, pull, at, at + 1))
            d -= own * q
            q += d
            products.append(weight * q * (q - d))
        assert np.ptp(means) < 1e-4 * np.mean(means)
        assert np.mean(means) == pytest.approx(np.mean(products), rel=0.01)


def test_both_are_the_same_while_it_is_struck() -> None:
    """To rounding, up to the end of the touch: all modes are summed in each step."""
    engines = [_engine(_scene(False), in_blocks) for in_blocks in (True, False)]
    for engine in engines:
        start_mallet(engine, 10.0, 0.9, 0.0)
    while engines[0].mallets.state["begun"][0] != engines[0].mallets.state["oldest"][0]:
        for engine in engines:
            _take(engine, 1)
        assert _pull(engines[0]) == pytest.approx(_pull(engines[1]), rel=1e-4, abs=1e-6)
    ours, witness = (engine.modal.q for engine in engines)
    assert np.abs(ours - witness).max() < 1e-5 * np.abs(witness).max()
