"""A mesh for two threads sounds as by one, whoever takes which part, and whenever the second comes or goes."""

import dataclasses
import threading
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import copy_of, describe_renderer, new_engine
from drumstick.drum.calibrate import build
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.shared_sweep import DONE, FIRST_MASK, PARTS, SECOND_ONE, STOP, TAKEN
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.threads.shared_sweep import help_along, sweep_part
from drumstick.parameters.scene import Scene
from realtime.atomics import add_to, peek, poke
from realtime.records import is_there

RATE = 48_000
FRAMES = 6_000
EFFECTS: dict[str, dict[str, Any]] = {
    "none": {},
    "all that the sweep knows of": {
        "internal_loss": InternalLossTable(),
        "muffle": MuffleTable(),
        "tension": TensionTable(),
        "cavity": CavityTable(),
    },
}


def scene_of(effects: dict[str, Any], threads: int = 2) -> Scene:
    scene = Scene("drum")
    mesh = dataclasses.replace(scene.mesh, accuracy="draft", threads=threads)  # always of second order
    return dataclasses.replace(scene, mesh=mesh, drum=dataclasses.replace(scene.drum, effects=effects))


def struck(engine: Engine) -> Engine:
    ring = StrikeRing()
    found = copy_of(engine, ring)
    ring.push(0, 0.4, 0.1, 20.0, 0.004)
    return found


def played(engine: Engine) -> npt.NDArray[np.float32]:
    out = np.zeros((FRAMES, 2), np.float32)
    render_all(engine, out, 128, 0)
    return out


class Second:
    """Second thread of an engine, between `with` and its end."""

    def __init__(self, engine: Engine) -> None:
        self._cells, clock = engine.shared_sweep.cells, np.zeros(2, np.int64)
        poke(self._cells, STOP, 1)
        help_along(engine, clock)  # compiles
        self._thread = threading.Thread(target=help_along, args=(engine, clock))

    def __enter__(self) -> None:
        poke(self._cells, STOP, 0)
        self._thread.start()

    def take_all(self) -> None:
        """Leave a step to it, and wait until it is done."""
        poke(self._cells, DONE, 0)
        poke(self._cells, TAKEN, 0)
        while peek(self._cells, DONE) < PARTS:
            pass

    def __exit__(self, *_: object) -> None:
        poke(self._cells, STOP, 1)
        self._thread.join()


@pytest.fixture(params=EFFECTS, scope="module")
def rested(request: pytest.FixtureRequest) -> Engine:
    return build(scene_of(EFFECTS[request.param]), RATE, StrikeRing())


def test_two_threads_give_the_samples_of_one(rested: Engine) -> None:
    one, two = struck(rested), struck(rested)
    expected = played(one)
    second = Second(two)
    with second:
        second.take_all()
        found = played(two)
    assert np.abs(expected).max() > 1e-4
    assert np.array_equal(found, expected)


def test_a_shared_mesh_sounds_as_one_that_is_not() -> None:
    # With all effects: one without any is judged below, step by step, against the equation.
    scenes = [scene_of(EFFECTS["all that the sweep knows of"], threads) for threads in (1, 2)]
    alone, shared = (played(struck(build(scene, RATE, StrikeRing()))) for scene in scenes)
    # Sums of a second head's pressure are rounded in another order.
    assert shared == pytest.approx(alone, abs=1e-6 * float(np.abs(alone).max()))


def test_the_second_thread_takes_every_part_that_is_left_to_it() -> None:
    # A step of which the audio thread takes nothing, as it would be with a core that stands still.
    engine = struck(build(scene_of({}), RATE, StrikeRing()))
    played(engine)
    level = int(engine.control["present_level"][0])
    before = engine.head.time_levels.copy()
    second = Second(engine)
    with second:
        second.take_all()
    after = engine.head.time_levels
    assert np.array_equal(after[level], before[level])
    expected = _plain_step(engine, before[level], before[1 - level])
    assert np.abs(after[1 - level]).max() > 1e-9
    assert after[1 - level] == pytest.approx(expected, abs=1e-6 * float(np.abs(expected).max()))


def _plain_step(
    engine: Engine, u: npt.NDArray[np.float32], u_old: npt.NDArray[np.float32]
) -> npt.NDArray[np.float64]:
    # u+ = w sum6(u) + u_gain u - u_old_gain u-, row by row, in double precision.
    grid = engine.head.grid[0]
    stride = int(grid["stride"])
    control = engine.control[0]
    rows = u.reshape(-1, stride).astype(float)
    around = np.roll(rows, 1, 1) + np.roll(rows, -1, 1)
    odd = ((np.arange(len(rows)) - int(grid["centre_row"])) % 2 == 1)[:, None]
    for beside in (np.roll(rows, 1, 0), np.roll(rows, -1, 0)):
        around += beside + np.where(odd, np.roll(beside, -1, 1), np.roll(beside, 1, 1))
    weights = engine.head.weights.reshape(-1, stride)
    coming = weights * around + float(control["u_gain"]) * rows
    return np.where(
        weights > 0.0, coming - float(control["u_old_gain"]) * u_old.reshape(-1, stride), 0.0
    ).ravel()


def test_the_second_thread_may_come_and_go() -> None:
    rested = build(scene_of({}), RATE, StrikeRing())
    expected = played(struck(rested))
    shared, found = struck(rested), list[npt.NDArray[np.float32]]()
    audio = threading.Thread(target=lambda: found.append(played(shared)))
    audio.start()
    while audio.is_alive():
        with Second(shared):
            pass
    audio.join()
    assert np.array_equal(found[0], expected)


def test_a_part_that_the_second_thread_has_begun_is_waited_for() -> None:
    rested = build(scene_of({}), RATE, StrikeRing())
    shared, found = struck(rested), list[npt.NDArray[np.float32]]()
    cells, begun = shared.shared_sweep.cells, threading.Event()

    def play() -> None:
        while not begun.is_set():
            found.append(played(shared))

    audio = threading.Thread(target=play)
    audio.start()
    before = PARTS
    while before >= PARTS:  # this test is the second thread, and takes the last part of a step
        if peek(cells, TAKEN) < PARTS:
            before = add_to(cells, TAKEN, SECOND_ONE) & FIRST_MASK
    begun.set()
    while (
        peek(cells, TAKEN) & FIRST_MASK < PARTS
    ):  # the audio thread has looked once more, and found no part left
        pass
    at = int(shared.control["steps"][0])
    for _ in range(
        10_000
    ):  # as long as many steps take; had it gone on later, other samples would be found below
        assert int(shared.control["steps"][0]) == at
    assert audio.is_alive()
    sweep_part(shared, PARTS - 1)
    add_to(cells, DONE, 1)
    audio.join()
    alone = struck(rested)
    assert np.array_equal(found, [played(alone) for _ in found])


def test_a_scene_of_one_thread_has_nothing_of_it() -> None:
    engine = new_engine(scene_of({}, threads=1), RATE, StrikeRing())
    assert not is_there(engine.shared_sweep)
    assert "two threads" not in describe_renderer(engine)
    assert "for two threads" in describe_renderer(new_engine(scene_of({}), RATE, StrikeRing()))


def test_parts_are_the_whole_mesh_once() -> None:
    shared = new_engine(scene_of({}), RATE, StrikeRing()).shared_sweep
    head = new_engine(scene_of({}), RATE, StrikeRing()).head
    assert shared.strips[0] == 0
    assert shared.strips[-1] == len(head.strips)
    assert (np.diff(shared.strips) >= 0).all()
