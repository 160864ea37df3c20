"""Picture of a drum: nothing is copied while nobody looks, and it is the head, in metres."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.engine import Engine
from drumstick.drum.length_unit import metres_per_unit
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.surface import RINGS, SPOKES, rings
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.building import highest_zero
from drumstick.drum.modal.surface import of_modes
from drumstick.drum.output.display_data import FRAMES_PER_S, last_heard, request_display, take_surface
from drumstick.parameters.drum import Drum, Mesh, Modal
from drumstick.parameters.scene import Scene
from realtime.kernels.jit import allocations
from sound_server.display import in_sixteen_bits, spectrum

RATE = 48_000
BLOCK = 128
SCENE = Scene("drum", drum=Drum(f01_Hz=150.0, t60_s=5.0))


def struck(scene: Scene = SCENE, contact_s: float = 0.005, x: float = 0.3) -> Engine:
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    ring.push(0, x, 0.0, 2.0, contact_s)
    return engine


def play(engine: Engine, seconds: float) -> int:
    """Play block by block; how many surfaces were shown."""
    out, shown = np.zeros((BLOCK, 2), np.float32), 0
    for _ in range(round(seconds * RATE / BLOCK)):
        render_all(engine, out, BLOCK, 0)
        shown += take_surface(engine.shown) is not None
    return shown


def surface_after(engine: Engine, seconds: float) -> npt.NDArray[np.float64]:
    """Heights after so long, in the renderer's own unit."""
    request_display(engine.shown, surface=True, sound=False)
    steps = round(seconds * RATE / engine.control["divisor"][0])
    out = np.zeros((int(engine.control["divisor"][0]), 2), np.float32)
    for _ in range(steps):
        engine.shown.pace["due"] = 0
        render_all(engine, out, len(out), 0)
    found = take_surface(engine.shown)
    assert found is not None
    return found.astype(np.float64)


def test_nothing_is_copied_while_nobody_looks() -> None:
    engine = struck()
    before = [np.copy(array) for array in (engine.shown.cells, engine.shown.slots, engine.shown.heard)]
    assert play(engine, 0.5) == 0
    assert np.abs(engine.head.time_levels).max() > 0.0
    for was, array in zip(before, (engine.shown.cells, engine.shown.slots, engine.shown.heard), strict=True):
        assert np.array_equal(was, array)


def test_thirty_surfaces_a_second_and_none_of_a_head_that_rests() -> None:
    engine = struck(dataclasses.replace(SCENE, drum=dataclasses.replace(SCENE.drum, t60_s=0.1)))
    request_display(engine.shown, surface=True, sound=False)
    assert play(engine, 0.5) == pytest.approx(0.5 * FRAMES_PER_S, abs=1)
    play(engine, 0.5)
    assert engine.control["asleep"][0] == 1
    last = take_surface(engine.shown)
    assert play(engine, 0.5) == 0
    request_display(engine.shown, surface=False, sound=False)
    request_display(engine.shown, surface=True, sound=False)
    assert last is None
    assert play(engine, 0.2) == 1  # for one who has just come
    assert not engine.shown.slots[engine.shown.cells[16]].any()


def test_looking_allocates_nothing() -> None:
    """A call from Python does, for each array that it hands over: as many, whether one looks or not."""
    engine = struck()
    out = np.zeros((BLOCK, 2), np.float32)
    counted: list[int] = []
    for looked in (False, True):
        request_display(engine.shown, looked, looked)
        render_all(engine, out, BLOCK, 0)
        before = allocations()
        for _ in range(1000):
            render_all(engine, out, BLOCK, 0)
        counted.append(allocations() - before)
    assert take_surface(engine.shown) is not None
    assert counted[0] == counted[1]


def test_looking_changes_no_sample() -> None:
    seen, unseen = struck(), struck()
    request_display(seen.shown, surface=True, sound=True)
    sounds: list[npt.NDArray[np.float32]] = []
    for engine in (seen, unseen):
        out = np.zeros((RATE // 4, 2), np.float32)
        render_all(engine, out, BLOCK, 0)
        sounds.append(out)
    assert np.array_equal(*sounds)


def momentum(heights_a_second: npt.NDArray[np.float64], radius_m: float, kg_per_m2: float) -> float:
    """Momentum, N s, of a head whose places move so fast, m/s: over the rings, by trapezia along the radius."""
    r = np.append(np.arange(RINGS + 1), RINGS + 1) / (RINGS + 1)
    means = [heights_a_second[0], *heights_a_second[1:].reshape(RINGS, SPOKES).mean(axis=1), 0.0]
    return float(2.0 * math.pi * radius_m**2 * kg_per_m2 * np.trapezoid(np.array(means) * r, r))


def test_metres_are_metres() -> None:
    """Before the wave reaches the rim, the head has the blow's whole momentum, as far as the rings can tell."""
    scene = SCENE
    contact_s, peak_N = 0.001, 2.0
    step_s = 3.0 / RATE
    engine = struck(scene, contact_s, x=0.0)
    before = surface_after(engine, 0.0018)
    after = surface_after(engine, step_s)
    radius_m = scene.drum.radius_m
    kg_per_m2 = 0.26
    c_m_per_s = 2.0 * math.pi * scene.drum.f01_Hz * radius_m / J01
    assert metres_per_unit(scene) == pytest.approx(1.0 / (kg_per_m2 * c_m_per_s**2))
    moving = metres_per_unit(scene) * (after - before) / step_s
    impulse = peak_N * contact_s * 2.0 / math.pi
    assert momentum(moving, radius_m, kg_per_m2) == pytest.approx(impulse, rel=0.05)


@pytest.mark.parametrize("accuracy", ["draft", "fine"])
def test_a_mesh_and_a_bank_of_modes_show_the_same_head(accuracy: str) -> None:
    meshed = dataclasses.replace(SCENE, mesh=Mesh(accuracy=accuracy))  # pyright: ignore[reportArgumentType]
    exact = dataclasses.replace(SCENE, modal=Modal(top_Hz=4000.0))
    here = surface_after(struck(meshed), 0.012)
    engine = struck(exact)
    shapes = of_modes(highest_zero(exact, RATE / engine.control["divisor"][0]), exact.drum).shapes
    assert shapes is not None
    there = shapes @ surface_after(engine, 0.012)
    assert np.abs(here - there).max() < 0.06 * np.abs(there).max()


def test_the_places_lie_on_the_rings() -> None:
    x, y = rings()
    assert (x[0], y[0]) == (0.0, 0.0)
    assert np.hypot(x[1:], y[1:]).reshape(RINGS, SPOKES).std(axis=1).max() < 1e-12
    assert (x[1], y[1]) == pytest.approx((1.0 / (RINGS + 1), 0.0))
    assert y[1 + SPOKES // 4] > 0.0


def test_what_was_heard_last_is_what_sounded_last() -> None:
    engine = struck()
    request_display(engine.shown, surface=False, sound=True)
    sound = np.zeros((40_000, 2), np.float32)
    render_all(engine, sound, BLOCK, 0)
    assert np.abs(sound).max() < 0.6  # the limiter, which comes later, changes nothing
    assert last_heard(engine.shown, 16_384) == pytest.approx(sound[-16_384:].mean(axis=1), abs=1e-6)


def test_a_sine_stands_in_the_spectrum_where_and_as_high_as_it_is() -> None:
    sine = (0.5 * np.sin(2.0 * math.pi * 440.0 * np.arange(16_384) / RATE)).astype(np.float32)
    levels = spectrum(sine, RATE, 1200.0)
    assert len(levels) == 400
    assert np.argmax(levels) / 400 * 1200.0 == pytest.approx(440.0, abs=4.0)
    assert levels.max() == pytest.approx(-6.02, abs=1.5)  # between two bins a window loses up to 1.4 dB
    assert levels[-1] < -90.0


def test_sixteen_bits_keep_the_shape() -> None:
    heights = np.array([0.0, 1e-5, -2e-3, 1.3e-4])
    unit, packed = in_sixteen_bits(heights)
    assert unit * np.frombuffer(packed, "<i2") == pytest.approx(heights, abs=unit)
    assert in_sixteen_bits(np.zeros(3)) == (0.0, b"\0" * 6)
