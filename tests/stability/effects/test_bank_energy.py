"""The energy of a bank of modes with its effects, in blocks of any length: nothing that it holds makes any.

Looked at from outside, in float64, at the ends of blocks: tests/mallets.py.
"""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import copy_of, new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.kettle import KettleTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.excitation.analytic import begin
from drumstick.drum.memory.bank import CELL
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.bank import compute_strike_weights
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from mallets import in_bank, joules, start_mallet, with_mallet
from realtime.records import is_there
from stability.catalogue import shows

RATE = 48_000
HARDEST_M_PER_S = 13.0
ROUNDING = 2e-6  # of the largest energy: float32's
# Of the least energy since a stroke came: what the drum lets pass, and as much again in the last cell.
IN_BLOCKS = 2e-4
EFFECTS: dict[str, object] = {
    "air": AirTable(1.2, 0.3, "none", bending_N_m=0.005),
    "kettle": KettleTable(0.3),
    "uniform_loss": UniformLossTable(5.0),
    "internal_loss": InternalLossTable(5.0, 3000.0),
    "muffle": MuffleTable(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3)), 0.05, 0.0),
    "tension": TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=500.0),
    "rim": RimTable(),
}
# None, each alone, all but one, all; a kettle needs the air.
SUBSETS = [
    names
    for count in (0, 1, len(EFFECTS) - 1, len(EFFECTS))
    for names in itertools.combinations(EFFECTS, count)
    if "air" in names or "kettle" not in names
]
TOM = ("air", "internal_loss", "muffle", "tension")


def _scene(
    effects: tuple[str, ...], most_cents: float = 500.0, f01_Hz: float = 120.0, top_Hz: float = 4000.0
) -> Scene:
    chosen = {name: EFFECTS[name] for name in effects}
    if "tension" in chosen:
        chosen["tension"] = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=most_cents)
    t60_s = 20.0 if "internal_loss" in effects else math.inf
    drum = Drum(f01_Hz=f01_Hz, radius_m=0.17, t60_s=t60_s, effects=chosen)
    return with_mallet(Scene("bank", drum=drum, modal=Modal(top_Hz)))


def _engine(scene: Scene, in_blocks: bool = True) -> Engine:
    engine = new_engine(scene, RATE, StrikeRing())
    if is_there(engine.effects.muffle):
        engine.effects.muffle.state["most"] = 1.0  # the whole way at once, as no set can make it
    return engine if in_blocks else engine._replace(blocks=None)


def _take(engine: Engine, steps: int) -> None:
    out = np.zeros((steps * int(engine.control["divisor"][0]), 2), np.float32)
    render_all(engine, out, len(out), 0)


def _to_a_cells_end(engine: Engine) -> None:
    _take(engine, CELL - int(engine.control["steps"][0]) % CELL)


def _pull(engine: Engine) -> float:
    # Of the most that it may be; 0 without a tension.
    if not is_there(engine.effects.tension):
        return 0.0
    tight = engine.effects.tension.state[0]
    return float(tight["pull"] / tight["q_most"])


def _plays(engine: Engine) -> bool:
    return bool(engine.mallets.state["begun"][0] != engine.mallets.state["oldest"][0])


def _growth_of_strokes(engine: Engine, in_blocks: bool) -> tuple[float, float]:
    # What the energy is above its least since a stroke came, in what it may be; and the largest pull. Strokes come
    # while the last one touches, and a muffle jumps meanwhile.
    chance, worst, most = np.random.default_rng(7), 0.0, 0.0
    for length in (30, 90, 900, 2500):
        start_mallet(
            engine, HARDEST_M_PER_S * float(chance.uniform(0.3, 1.0)), *chance.uniform(-0.68, 0.68, 2)
        )
        _take(engine, 1)  # it arrives, with what it has
        least = largest = joules(engine)
        while length > 0:
            if is_there(engine.effects.muffle) and chance.random() < 0.1:
                set_live(engine, "muffle", float(chance.choice([0.0, 0.1, 1.0])))
            steps = 1
            if in_blocks:
                steps = (
                    int(chance.choice([1, 3, CELL, 200]))
                    if not _plays(engine)
                    else int(chance.integers(1, 9))
                )
            _take(engine, steps)
            now = joules(engine)
            may = ROUNDING * largest + (IN_BLOCKS * least if in_blocks and most > 0.0 else 0.0)
            worst = max(worst, (now - least) / may) if now >= 0.0 else math.inf
            least, most = min(least, now), max(most, _pull(engine))
            length -= steps
    assert least < largest
    return worst, most


@pytest.mark.long
@pytest.mark.parametrize("in_blocks", [True, False], ids=["in blocks", "step by step"])
def test_no_effects_of_a_bank_together_make_energy(in_blocks: bool) -> None:
    """Under the hardest strokes: each look at most what was there before, and what blocks may add."""
    for names in SUBSETS:
        worst, most = _growth_of_strokes(_engine(_scene(names), in_blocks), in_blocks)
        assert worst <= 1.0, names
        assert (most > 0.5) == ("tension" in names), names


@pytest.mark.parametrize("in_blocks", [True, False], ids=["in blocks", "step by step"])
@pytest.mark.daily("in blocks")
def test_nor_do_those_of_a_tom(in_blocks: bool) -> None:
    worst, most = _growth_of_strokes(_engine(_scene(TOM), in_blocks), in_blocks)
    assert worst <= 1.0
    assert most > 0.5


@pytest.mark.parametrize("name", ["high-tom", "mid-tom", "low-tom"])
@pytest.mark.daily("high-tom")
def test_a_shipped_tom_under_its_hardest_strokes_loses_in_every_cell(name: str) -> None:
    """As it ships, in blocks of 16 steps and never otherwise; and with every loss taken out nothing is left that gives.
    The pull is at its limit while a mallet touches."""
    for x, is_lossless in itertools.product((0.0, 0.3, 0.8, 0.95), (False, True)):
        engine = new_engine(parse(shipped_text(name), name), RATE, StrikeRing())
        if is_lossless:
            engine.modal.r_squared[:] = 1.0
        start_mallet(engine, HARDEST_M_PER_S, x, 0.0)
        _take(engine, 1)
        held, most = first, _ = joules(engine), 0.0
        while _plays(engine):
            _take(engine, 1)
            now = joules(engine)
            assert now <= held + 2e-7 * first
            held, most = now, max(most, _pull(engine))
        assert most == 1.0
        _to_a_cells_end(engine)
        energies = [in_bank(engine)]
        for _ in range(600):
            _take(engine, CELL)
            energies.append(in_bank(engine))
        changes = np.diff(energies) / energies[:-1]
        assert changes.max() < (3e-5 if is_lossless else 0.0)
        assert max(energies) <= (1.0 + 3e-6) * energies[0]
        assert engine.blocks.state["apart"][0] == 1
        assert engine.blocks.state["whole_until"][0] == 0


def _ring(
    engine: Engine, modes: tuple[int, int], rise: float, others: float, chance: np.random.Generator
) -> None:
    # These radial modes, of all phases, which raise the tension by this share; all others by so much of their height.
    bank, count, tight = engine.modal, len(engine.modal.orders), engine.effects.tension.state
    own = np.zeros(len(bank.q))
    own[:count], own[count : 2 * count] = others, others * (bank.orders > 0)
    for first in (0, count):
        own[first + modes[0] : first + modes[1]] /= others
    weights = bank.stretch_weights.astype(float)
    q = own * chance.standard_normal(len(own)) / np.sqrt(np.maximum(weights, 1e-30))
    q *= math.sqrt(2.0 * rise / float(tight["kappa"][0]) / float(np.sum(weights * q**2)))
    phases = chance.uniform(0.0, 2.0 * math.pi, len(q))
    bank.q[:] = q * np.cos(phases)
    bank.d[:] = q * np.sin(phases) * np.sqrt(bank.stiffness * (1.0 + rise))
    engine.control["asleep"], engine.control["loudest"] = 0, float(np.abs(q).max())
    _take(engine, 1)  # by the bank's own sums from here on


def _take_watched(engine: Engine, steps: int, is_watched: bool) -> None:
    # Cell by cell: where it is not watched no growth comes to be known.
    while steps > 0:
        if not is_watched:
            engine.blocks.state["energy"], engine.blocks.state["whole_until"] = math.inf, 0
        some = min(steps, CELL - int(engine.control["steps"][0]) % CELL)
        _take(engine, some)
        steps -= some


def _growth(engine: Engine, cells: int, block: int = CELL, is_watched: bool = True) -> float:
    # Of the energy now, over its least before.
    least, worst = in_bank(engine), 0.0
    for _ in range(cells):
        _take_watched(engine, block, is_watched)
        now = in_bank(engine)
        worst, least = max(worst, now / least - 1.0) if now >= 0.0 else math.inf, min(least, now)
    return worst


def _lowest(engine: Engine) -> int:
    return int(engine.blocks.state["lowest"][0])


def _pump(engine: Engine) -> None:
    # The highest of those that go step by step, and a little of all others.
    lowest = _lowest(engine)
    _ring(engine, (lowest - 16, lowest), 0.3, 1e-2, np.random.default_rng(1))


@shows("modes in blocks under tension")
@pytest.mark.parametrize("is_watched", [False, True], ids=["naive", "ours"])
def test_low_modes_do_not_pump_high_ones(is_watched: bool) -> None:
    engine = _engine(_scene(("tension",), 1200.0))
    _pump(engine)
    growth = _growth(engine, 600, is_watched=is_watched)
    if is_watched:
        assert growth <= IN_BLOCKS
        assert engine.blocks.state["whole_until"][0] > 0
        assert engine.blocks.state["apart"][0] == 0
    else:
        assert growth > 1.0


# Blows, place, N, and rate over the pitch of the lowest modes in blocks: 1.7 kHz.
BUZZES = (
    (59, 0.9216, 44.0, 0.9884),
    (57, 0.6359, 66.0, 0.9828),
    (126, 0.7603, 36.0, 0.979),
    (30, 0.833, 65.0, 0.9983),
)
IN_A_CELL = 2e-2  # of a drum that is pulled an octave up: found 8e-3 at most, before it was seen


def _buzz(engine: Engine, buzz: tuple[int, float, float, float], is_watched: bool) -> None:
    count, x, size_N, rate = buzz
    period = 2.0 * math.pi / math.acos(1.0 - 0.5 * float(engine.modal.stiffness[_lowest(engine)])) / rate
    for n in range(count):
        begun, at = int(engine.control["begun"][0]), n * period
        compute_strike_weights(engine.modal, begun % len(engine.pulses), x, 0.0)
        engine.control["begun"] = begin(
            engine.pulses, begun, x, 0.0, math.floor(at) - at, 0.5 * period, size_N
        )
        engine.control["asleep"] = 0
        _take_watched(engine, math.floor(at + period) - math.floor(at), is_watched)
    _take_watched(engine, 4 * CELL, is_watched)
    _take_watched(engine, CELL - int(engine.control["steps"][0]) % CELL, is_watched)


@shows("modes in blocks under tension")
@pytest.mark.parametrize("is_watched", [False, True], ids=["naive", "ours"])
def test_nor_after_a_buzz_of_blows(is_watched: bool) -> None:
    """Blows of tens of newtons, on a drum that loses its energy within a second."""
    scene = _scene(("internal_loss", "tension"), 1200.0, 101.0, 3316.0)
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, t60_s=1.4))
    built, growths, seen = _engine(scene), list[float](), 0
    for buzz in BUZZES:
        engine = copy_of(built, StrikeRing())
        _buzz(engine, buzz, is_watched)
        assert _pull(engine) > 0.7
        rang_in_blocks = not engine.blocks.state["whole_until"][0]
        growths.append(_growth(engine, 300, is_watched=is_watched))
        seen += rang_in_blocks and bool(engine.blocks.state["whole_until"][0])
    if is_watched:
        assert max(growths) <= IN_A_CELL
        assert seen > 0
    else:
        assert max(growths) > 5.0
        assert seen == 0


@shows("modes in blocks under tension", "ours")
@pytest.mark.parametrize("block", [1, 7, 500])
def test_it_goes_step_by_step_from_the_same_step_on_whatever_the_block(block: int) -> None:
    """The same bits; and later it rings in blocks again."""

    def rung(block: int) -> Engine:
        engine = _engine(_scene(("tension",), 1200.0))
        _pump(engine)
        for begin_at in range(1, 2001, block):
            _take(engine, min(block, 2001 - begin_at))
        return engine

    engine, other = rung(block), rung(CELL)
    until = int(engine.blocks.state["whole_until"][0])
    assert until == other.blocks.state["whole_until"][0] > 0
    np.testing.assert_array_equal(engine.modal.q, other.modal.q)
    engine.control["steps"] = until
    _take(engine, CELL)
    assert engine.blocks.state["apart"][0] == 1


@pytest.mark.daily("500.0")
@pytest.mark.parametrize("most_cents", [100.0, 500.0, 1200.0])
def test_nor_does_a_pull_at_its_limit(most_cents: float) -> None:
    """For six thousand steps in blocks, and none of it by the way of the single step."""
    engine = _engine(_scene(("tension",), most_cents))
    rise = float(engine.effects.tension.state["q_most"][0])
    _ring(engine, (0, 5), 1.5 * rise, 1e-4, np.random.default_rng(2))
    pulls = list[float]()
    for _ in range(40):
        assert _growth(engine, 10) <= 2e-5
        pulls.append(_pull(engine))
    assert max(pulls) == 1.0
    assert engine.blocks.state["apart"][0] == 1
