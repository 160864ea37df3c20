"""A bank's steps taken in blocks, against the same steps one by one: to rounding; of whatever length, the same bits."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.mallets.mallet import PLAYING
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.memory.bank import STEPS, TILE, Bank
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.bank import step_modes
from drumstick.drum.modal.blocks import block_of
from drumstick.drum.modal.building import bank_of
from drumstick.drum.step import step
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.mallet import MATERIALS
from drumstick.parameters.scene import Scene
from machine_code import linked_within
from mallets import with_mallet
from realtime.kernels.jit import allocations, njit

RATE = 48_000
EPOCH_NS = 10**9
MICROPHONES = ((-0.5, 0.6, 0.8, -0.6), (0.6, 0.5, 0.8, 0.6))
Floats = npt.NDArray[np.float32]


class Stroke(NamedTuple):
    """One strike: when, in samples; how hard; where."""

    at: float
    speed: float
    x: float
    y: float


# Begins between two samples; two at once, which overlap; another place; one that ends just where a block does.
STROKES = [
    Stroke(100.3, 1.0, 0.3, 0.2),
    Stroke(150.0, 0.4, -0.6, 0.1),
    Stroke(1500.7, 1.5, 0.0, 0.9),
    Stroke(1500.7, 0.7, 0.2, -0.5),
    Stroke(2048.0, 0.2, 0.0, 0.0),
]


def scene_of(top_Hz: float = 5000.0, microphones: bool = False, **effects: object) -> Scene:
    listen = Listen(microphones=MICROPHONES) if microphones else Listen()
    return Scene("bank", drum=Drum(t60_s=0.5, effects=effects), modal=Modal(top_Hz), listen=listen)


SCENES = {
    "pickups": scene_of(),
    "microphones, rim": scene_of(microphones=True, rim=RimTable()),
    "losses": scene_of(internal_loss=InternalLossTable()),
    "every fourth sample": scene_of(2000.0),
    "mallets": with_mallet(scene_of()),
    "felt mallets": with_mallet(scene_of(), **{"material": "felt", **MATERIALS["felt"]}),
    "tension": scene_of(tension=TensionTable()),
}


def engine_of(scene: Scene, has_blocks: bool = True) -> tuple[Engine, StrikeRing]:
    """Its engine; without blocks, for the steps one by one."""
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    return engine if has_blocks else engine._replace(blocks=None), ring


def rendered(scene: Scene, has_blocks: bool) -> Floats:
    """The strokes in audio blocks of 128."""
    (engine, ring), out = engine_of(scene, has_blocks), np.zeros((6000, 2), np.float32)
    for at, speed, x, y in STROKES:
        ring.push_blow(strike_for_speed(scene, speed, x, y), EPOCH_NS + round(at * 1e9 / RATE))
    render_all(engine, out, 128, EPOCH_NS)
    return out


@pytest.mark.parametrize("name", [name for name in SCENES if name != "tension"])
def test_it_sounds_as_one_by_one(name: str) -> None:
    in_blocks, one_by_one = (rendered(SCENES[name], has_blocks) for has_blocks in (True, False))
    assert np.abs(one_by_one).max() > 0.05
    assert np.abs(in_blocks - one_by_one).max() < 1e-5 * np.abs(one_by_one).max()


@pytest.mark.parametrize("name", ["pickups", "every fourth sample", "mallets", "tension"])
def test_the_same_bits_in_blocks_of_any_length(name: str) -> None:
    """Audio blocks of one sample, odd ones, and one longer than a block of the bank; live and offline are these.

    Strokes at once, between two blocks: when one is due is known to a nanosecond, counted from its audio block's begin.
    """
    found: set[bytes] = set()
    for block in (1, 7, 128, 255, 2000):
        (engine, ring), out = engine_of(SCENES[name]), np.zeros((8000, 2), np.float32)
        for part, stroke in zip(np.split(out, 4), STROKES, strict=False):
            ring.push_blow(strike_for_speed(SCENES[name], stroke.speed, stroke.x, stroke.y))
            render_all(engine, part, block, EPOCH_NS)
        found.add(out.tobytes())
    assert len(found) == 1


def test_a_mallet_is_met_step_by_step_and_left_in_blocks() -> None:
    """While one plays no step is taken ahead; before and after it, all of them are."""
    scene = SCENES["mallets"]
    engine, ring = engine_of(scene)
    ring.push_blow(strike_for_speed(scene, 1.0, 0.3, 0.2), EPOCH_NS + round(1000e9 / RATE))
    out, ahead, played = np.zeros((100, 2), np.float32), [0, 0], 0
    for done in range(0, 20_000, 100):
        state = engine.blocks.state[0]
        state["steps"] = state["taken"] = 0
        render_all(engine, out, 100, EPOCH_NS + round(done * 1e9 / RATE))
        plays = bool((engine.mallets.pool["stage"] == PLAYING).any())
        played += plays
        if plays and done > 1000:
            assert state["steps"] == 0
        ahead[plays] += int(state["steps"])
    assert 0 < played < 100
    assert ahead[0] > 6000  # of 100/3 a block


def test_it_rests_as_one_by_one() -> None:
    """The look whether it rests comes at the same step, and leaves exact silence."""
    scene = dataclasses.replace(SCENES["pickups"], drum=Drum(t60_s=0.03))
    asleep: list[list[int]] = []
    for has_blocks in (True, False):
        engine, ring = engine_of(scene, has_blocks)
        ring.push_blow(strike_for_speed(scene, 1.0, 0.3, 0.2))
        out, found = np.zeros((300, 2), np.float32), list[int]()
        for _ in range(100):
            render_all(engine, out, 300, 0)
            found.append(int(engine.control["asleep"][0]))
        assert found[-1] == 1
        assert not engine.modal.q.any()
        assert not engine.modal.d.any()
        assert not out.any()
        asleep.append(found)
    assert asleep[0] == asleep[1]


def test_the_step_of_a_mesh_has_nothing_of_it() -> None:
    linked = linked_within(step, new_engine(Scene("mesh"), RATE, StrikeRing()), 0)
    own = (
        "drumstick.drum.modal.",
        "drumstick.drum.step._run_ahead",
        "drumstick.drum.excitation.analytic.forces_ahead",
    )
    assert any(name.startswith("drumstick.drum.step.") for name in linked)
    assert not [name for name in linked if name.startswith(own)]


def test_a_tail_has_no_denormal_numbers() -> None:
    engine, _ = engine_of(SCENES["pickups"])
    engine.modal.q[:], engine.control["asleep"], engine.control["loudest"] = 3e-38, 0, 1e-30
    render_all(engine, np.zeros((512, 2), np.float32), 256, 0)
    for array in (engine.modal.q, engine.modal.d, engine.blocks.heard):
        assert not ((array != 0.0) & (np.abs(array) < np.finfo(np.float32).tiny)).any()


@pytest.mark.parametrize("name", ["pickups", "tension"])
def test_nothing_is_allocated(name: str) -> None:
    """The call from Python wraps its arrays once; seventy blocks more must not add to that."""
    scene, out, counts = SCENES[name], np.zeros((9000, 2), np.float32), set[int]()
    engine, ring = engine_of(scene)
    render_all(engine, out[:128], 128, 0)
    for frames in (128, 9000):
        ring.push_blow(strike_for_speed(scene, 1.0, 0.3, 0.2))
        before = allocations()
        render_all(engine, out[:frames], 128, 0)
        counts.add(allocations() - before)
    assert len(counts) == 1


def block_at(width: int) -> Any:
    block = block_of(width)

    @njit()
    def run(modes: Any, weights: Floats, rows: Any, forces: Floats, sums: Floats, heard: Floats) -> None:
        block(modes, (weights, rows, forces, forces[2]), sums, heard, 2, 200)

    return run


def rung(has_microphones: bool, tension: bool) -> tuple[Bank, Floats, Any]:
    """A bank that rings, the forces of two pulses, and in the third row the pulls."""
    effects: dict[str, Any] = {"tension": TensionTable()} if tension else {}
    scene = scene_of(microphones=has_microphones, **effects)
    bank, chance = bank_of(scene, 1.0 / RATE), np.random.default_rng(1)
    moves = np.arange(len(bank.q)) < 2 * len(bank.orders)
    bank.q[moves] = 1e-3 * chance.standard_normal(int(moves.sum()))
    bank.d[moves] = 1e-4 * chance.standard_normal(int(moves.sum()))
    bank.strike_weights[:, moves] = 1e-3 * chance.standard_normal((32, int(moves.sum())))
    forces = np.zeros((32, STEPS), np.float32)
    forces[0, 20:90], forces[1] = chance.standard_normal(70), chance.standard_normal(STEPS)
    forces[2] = 0.2 * tension * chance.standard_normal(STEPS)
    return bank, forces, np.array([7, 2] + 30 * [0])


@pytest.mark.parametrize("tension", [False, True])
@pytest.mark.parametrize("has_microphones", [False, True])
def test_every_width_takes_the_steps_that_one_by_one_are_taken(has_microphones: bool, tension: bool) -> None:
    """The very same q and d at each width; those of the steps one by one, and what is heard, to rounding."""
    plain, forces, rows = rung(has_microphones, tension)
    assert len(plain.q) % TILE == 0
    wanted = np.zeros((200, 2))
    for n in range(200):
        for number in range(2):
            plain.d[:] += plain.strike_weights[rows[number]] * forces[number, n]
        wanted[n] = step_modes(plain, float(forces[2, n]), 0, len(plain.q))
    bits: set[bytes] = set()
    for width in (1, 4, 8, 16):
        bank, _, _ = rung(has_microphones, tension)
        sums, heard = aligned((STEPS, 2, 16)), np.zeros((STEPS, 2), np.float32)
        modes = (*bank[:6], bank.left_by_displacement, bank.right_by_displacement, bank.tension_stiffness)
        block_at(width)(modes, bank.strike_weights, rows, forces, sums, heard)
        for found, right in ((bank.q, plain.q), (bank.d, plain.d), (heard[:200], wanted)):
            assert np.abs(found - right).max() < 3e-6 * np.abs(right).max()
        assert not heard[200:].any()
        bits.add(bank.q.tobytes() + bank.d.tobytes())
    assert len(bits) == 1
