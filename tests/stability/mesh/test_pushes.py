"""Forces that no stick makes: a million newtons, for ever the same, noise, none at all, and nowhere on the head."""

import dataclasses
import logging
import math

import numpy as np
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.snare import SnareTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.memory.strikes import StrikeRing
from membranes import energy
from protocol.messages import Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.strikes import StrikeScheduler
from stability.catalogue import shows
from stability.dense_mesh import DenseMesh
from stability.mesh_steps import RATE, drum_of, engine_of, height, strike, take

EVERYTHING: dict[str, object] = {
    "internal_loss": InternalLossTable(0.05, 4000.0),
    "muffle": MuffleTable(((0.5, 0.2, 0.3),), 0.05),
    "tension": TensionTable(300.0),
    "cavity": CavityTable(depth_m=0.05, f01_Hz=700.0, t60_s=0.3),
    "snare": SnareTable(),
    "rim": RimTable(),
}


def _as_sent(strike: dict[str, float]) -> bytes:
    values = {"x": 0.1, "y": 0.2, "peak_estimate_N": 5.0, "contact_estimate_s": 0.005} | strike
    return encode(Strike(boot=7, seq=1, t_ns=5, z_speed_m_per_s=0.6, level=0.3, **values))


def _scheduler(ring: StrikeRing) -> StrikeScheduler:
    return StrikeScheduler(ring, RateLimitedLog(lambda: 0), lambda _: None)


@shows("blow of a million newtons")
def test_a_blow_of_a_million_newtons_is_refused_limited_and_forgotten() -> None:
    """The naive end of the chain, samples cast to 16 bits, wraps round: loud places change their sign."""
    scene = drum_of({}, t60_s=0.1)
    ring = StrikeRing()
    scheduler = _scheduler(ring)
    scheduler.take(_as_sent({"peak_estimate_N": 1e6}), 5)
    assert (scheduler.refused, scheduler.played) == (1, 0)
    engine, usual = build(scene, RATE, ring), full_scale(scene)

    def stroke(peak_N: float) -> np.ndarray:
        ring.push(0, usual.x, usual.y, peak_N, usual.contact_s)
        sound = np.zeros((RATE // 2, 2), np.float32)
        render_all(engine, sound, 128, 0)
        return sound

    before = stroke(usual.peak_N)
    hard = stroke(1e6)  # past the sound server's checks
    assert np.isfinite(hard).all()
    assert 0.99 < np.abs(hard).max() <= 1.0
    # What is left of a blow 100 dB louder, after three more of its decays, is below one bit of 24.
    stroke(0.0)
    np.testing.assert_allclose(stroke(usual.peak_N), before, atol=2.0**-23)

    loud = before.astype(np.float64) * (1e6 / usual.peak_N)  # as the head itself plays it
    wrapped = (loud * 32767.0).astype(np.int64).astype(np.int16)
    beyond = np.abs(loud) > 1.0
    assert np.mean(np.sign(wrapped[beyond]) != np.sign(loud[beyond])) > 0.3
    assert np.array_equal(np.sign(hard[beyond]), np.sign(loud[beyond]))


@shows("steady push")
def test_a_push_that_never_ends_leaves_nothing_in_the_sound() -> None:
    """Pickups that heard where the head is, and not how fast, would put a constant into the output."""
    engine = engine_of(drum_of({}, t60_s=0.05))
    lasting = 1e10
    strike(engine, 1e4, steps=lasting, age=0.5 * lasting)
    onset = take(engine, 500)
    take(engine, 20_000)
    places, gains = engine.pickups, engine.pickup_gains[:, 0].astype(float)
    at = engine.head.time_levels[int(engine.control["present_level"][0])][places]
    bent = height(engine)
    assert abs(float(gains @ at)) > 0.1 * bent
    assert take(engine, 1000) < 1e-5 * onset
    take(engine, 100_000)
    assert height(engine) == pytest.approx(bent, rel=1e-5)  # it stays where it is


def _late_tension_in_noise(depth: float, steps: int) -> float:
    # As the explicit glide of the effects' cases; how loud it is at last, to the same head without a glide.
    mesh, sizes, half = DenseMesh(), list[float](), math.inf
    tau = 8.0 / 3.0 / (1.0 + 2.2 * depth)
    for _ in range(2):
        noise, u, stretch = np.random.default_rng(5), np.zeros(len(mesh.x)), 0.0
        before = u.copy()
        for _ in range(steps):
            stretch = mesh.stretch(u, before)
            q = 2.0 * depth * tau * stretch / (abs(stretch) + half)
            u, before = 0.999 * (2.0 * u - before + (tau + q) * (mesh.laplacian @ u)), 0.999 * u
            u[noise.integers(len(u))] += noise.uniform(-1.0, 1.0)
            if not abs(stretch) < 1e60:
                return math.inf
        sizes.append(float(np.sum(u * u)))
        half = 0.5 * stretch
    return sizes[1] / sizes[0]


@shows("noise")
def test_noise_at_full_scale_all_over_the_head_comes_to_a_level_and_stays_there() -> None:
    """A blow of a step in every step, in any place, with every effect. A late glide feeds on the same noise."""
    assert _late_tension_in_noise(0.05, 3000) > 1e6
    engine = engine_of(drum_of(EVERYTHING, t60_s=0.3))
    chance, tops = np.random.default_rng(4), list[float]()
    peak_N = full_scale(drum_of({})).peak_N
    for _ in range(10):
        top = 0.0
        for _ in range(2000):
            x, y = chance.uniform(-1.0, 1.0, 2)
            strike(engine, float(chance.uniform(-peak_N, peak_N)), x, y, steps=1.0)
            take(engine, 1)
            top = max(top, height(engine))
        tops.append(top)
    assert max(tops[5:]) < 1.5 * max(tops[:5])
    take(engine, 60_000)
    assert height(engine) < 1e-3 * tops[-1]


NOWHERE = [
    (1.0, 0.0),
    (-1.0, 0.0),
    (1.0 + 1e-9, 0.0),
    (1.0 - 1e-9, 0.0),
    (0.0, -1.0),
    (1.3, 0.0),
    (1.5, -1.5),
    (1e3, 7.0),
]
EDGES = [(math.cos(a), math.sin(a), 0.0) for a in np.linspace(0.0, 6.0, 7)]


@shows("places on the rim and beyond")
def test_strokes_and_pickups_on_the_rim_and_beyond_it_act_on_junctions_of_the_head() -> None:
    """A flat index from rounded coordinates leaves the head, or the array; what it pushes there rings on for ever."""
    scene = drum_of({}, mesh={"rate_Hz": 24_000.0})
    engine = engine_of(scene)
    grid, stride = engine.head.grid[0], int(engine.head.grid["stride"][0])
    beyond, outside = 0, list[int]()
    for x, y in NOWHERE:
        row = int(grid["centre_row"]) + round(y / (math.sqrt(0.75) * float(grid["spacing"])))
        at = row * stride + int(grid["centre_column"]) + round(x / float(grid["spacing"]))
        if not 0 <= at < engine.head.weights.size:
            beyond += 1
        elif engine.head.weights[at] == 0.0:
            outside.append(at)
    assert beyond >= 1
    assert len(outside) >= 3
    engine.head.time_levels[1 - int(engine.control["present_level"][0]), outside[0]] += 1.0
    take(engine, 10_000)
    assert engine.head.time_levels[:, outside].any()

    for x, y in NOWHERE:
        engine = engine_of(drum_of({}))
        strike(engine, 4.0, x, y)
        take(engine, 8)
        first = energy(engine)
        assert first > 0.0
        take(engine, 10_000)
        assert energy(engine) == pytest.approx(first, rel=1e-4)
        assert not engine.head.time_levels[:, engine.head.weights == 0.0].any()


@shows("places on the rim and beyond", "ours")
def test_pickups_on_the_rim_hear_the_head() -> None:
    scene = drum_of({}, t60_s=0.3)
    engine = engine_of(
        dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, pickups=tuple(EDGES)))
    )
    assert (engine.head.weights[engine.pickups] > 0.0).all()
    strike(engine, 4.0)
    assert 0.0 < take(engine, 2000) < math.inf


@shows("force that is no number")
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_force_that_is_no_number_is_dropped_and_counted(value: float) -> None:
    """One such force in the mesh: in as many steps as there are junctions across, all of it is NaN, for good."""
    naive = engine_of(drum_of({}, t60_s=0.3))
    strike(naive, value)
    take(naive, 60)
    assert np.isnan(naive.head.time_levels[:, naive.head.weights > 0.0]).all()

    logging.disable()
    try:
        ring = StrikeRing()
        scheduler = _scheduler(ring)
        for key in ("peak_estimate_N", "contact_estimate_s", "x", "y"):
            scheduler.take(_as_sent({key: value}), 5)
    finally:
        logging.disable(logging.NOTSET)
    assert (scheduler.refused, scheduler.played) == (4, 0)
    engine = build(drum_of({}, t60_s=0.3), RATE, ring)
    sound = np.zeros((4800, 2), np.float32)
    render_all(engine, sound, 128, 0)
    assert not sound.any()
    scheduler.take(_as_sent({}), 5)
    render_all(engine, sound, 128, 0)
    assert np.isfinite(sound).all()
    assert sound.any()
