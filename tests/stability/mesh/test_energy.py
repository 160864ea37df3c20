"""The drum's energy: constant without losses, never growing with any effect, under every blow at full scale."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from drumstick.drum.block import render_all
from drumstick.drum.build import Unplayable
from drumstick.drum.calibrate import build, full_scale, strike_for_speed
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.registry import DRUM_TABLES, MESH_EFFECTS
from drumstick.drum.effects.snare import SnareTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.scheme import Losses
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from membranes import energy
from realtime.records import is_there
from stability.catalogue import shows
from stability.mesh_steps import engine_of, strike, take

RATE = 48000
SMALL = {"f01_Hz": 600.0}
# Every effect that keeps energy, or takes it, and their meetings; each a type of engine, compiled once for the suite.
DRUMS: dict[str, dict[str, object]] = {
    "plain": {},
    "tension": {"tension": TensionTable(300.0)},
    "cavity": {"cavity": CavityTable(depth_m=0.1, f01_Hz=700.0, t60_s=60.0)},
    "snare": {"cavity": CavityTable(depth_m=0.1, f01_Hz=700.0, t60_s=2.0), "snare": SnareTable()},
    "muffle": {"muffle": MuffleTable(((0.5, 0.2, 0.3),), 0.01)},
}


def scene_of(effects: dict[str, object], t60_s: float = math.inf, **drum: float) -> Scene:
    scene = Scene("drum")
    changed = dataclasses.replace(scene.drum, effects=effects, t60_s=t60_s, **{**SMALL, **drum})
    return dataclasses.replace(scene, drum=changed)


def struck(scene: Scene, blows: list[tuple[float, float, float]]) -> Engine:
    """A drum after these blows (x, y, share of full scale), when their forces have ended."""
    engine, blow = engine_of(scene), full_scale(scene)
    steps = blow.contact_s * RATE / int(engine.control["divisor"][0])
    for x, y, share in blows:
        strike(engine, share * blow.peak_N, x, y, steps)
    play(engine, round((blow.contact_s + 0.001) * RATE))
    return engine


def play(engine: Engine, samples: int) -> None:
    """By the step alone, whose types of engine tests/stability/effects compile too: around it nothing has energy."""
    take(engine, samples // int(engine.control["divisor"][0]))


@shows("hundred million steps", "ours")
@pytest.mark.daily("plain-standard-rectilinear", "tension-fine-triangular")
@pytest.mark.parametrize(
    ("effects", "accuracy", "topology"),
    [
        ("plain", "standard", "triangular"),
        ("plain", "fine", "triangular"),
        ("plain", "standard", "rectilinear"),
        ("tension", "standard", "triangular"),
        ("tension", "fine", "triangular"),
    ],
)
def test_without_losses_energy_stays(effects: str, accuracy: str, topology: str) -> None:
    """A million samples. What is left is float32's rounding."""
    scene = scene_of(DRUMS[effects])
    scene = dataclasses.replace(
        scene, mesh=dataclasses.replace(scene.mesh, accuracy=accuracy, topology=topology)
    )
    engine = struck(scene, [(0.3, 0.2, 1.0)])
    first = energy(engine)
    for _ in range(10):
        play(engine, 100_000)
        assert energy(engine) == pytest.approx(first, rel=5e-4)
    assert not engine.head.time_levels[:, engine.head.weights == 0.0].any()


@shows("hundred million steps", "ours")
@pytest.mark.long
def test_ten_million_samples_of_the_shipped_drum() -> None:
    engine = struck(scene_of({}, f01_Hz=150.0), [(0.3, 0.2, 1.0)])
    first = energy(engine)
    for _ in range(10):
        play(engine, 1_000_000)
    assert energy(engine) == pytest.approx(first, rel=1e-3)


@shows("air between the heads", "ours")
@pytest.mark.parametrize("accuracy", ["standard", "fine"])
def test_two_heads_share_their_energy_and_keep_it(accuracy: str) -> None:
    """The second head's own losses are 60 s; within 0.02 s they take 0.5 % at most."""
    scene = scene_of(DRUMS["cavity"])
    mesh = dataclasses.replace(scene.mesh, accuracy=accuracy)
    engine = struck(dataclasses.replace(scene, mesh=mesh), [(0.0, 0.0, 1.0)])
    assert is_there(engine.effects.cavity)
    first, moved = energy(engine), 0.0
    for _ in range(100):
        play(engine, 10)
        assert energy(engine) == pytest.approx(first, rel=5e-3)
        moved = max(moved, float(np.abs(engine.effects.cavity.head.time_levels).max()))
    assert moved > 0.01 * float(np.abs(engine.head.time_levels).max())


@shows("effects that meet", "ours")
@pytest.mark.parametrize(
    ("mesh", "is_fourth"),
    [({}, True), ({"courant": "lossless"}, False), ({"topology": "rectilinear"}, False)],
    ids=["fourth order", "lossless", "square"],
)
def test_air_that_takes_nothing_keeps_energy(mesh: dict[str, str], is_fourth: bool) -> None:
    """The lowest modes are moved, by as heavy an air as there is; what it radiates is set to nothing."""
    scene = scene_of({"air": AirTable(3.0, 0.1)}, f01_Hz=1000.0, radius_m=0.04)
    scene = dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, **mesh))
    engine = struck(scene, [(0.3, 0.2, 1.0)])
    assert is_there(engine.effects.air)
    assert (engine.laplacian is not None) == is_fourth
    moved = engine.effects.air.moved  # kept for other drums: it is not written to
    silent = engine.effects.air._replace(moved=moved._replace(loss=np.zeros_like(moved.loss)))
    engine = engine._replace(effects=engine.effects._replace(air=silent))
    first = energy(engine)
    step = int(engine.control["divisor"][0])
    without, lent = engine._replace(effects=engine.effects._replace(air=None)), 0.0
    for samples in [step] * 100 + [997] * 20:
        play(engine, samples)
        assert energy(engine) == pytest.approx(first, rel=1e-5)
        lent = max(lent, energy(without) / first - 1.0)
    assert lent > 0.1


@shows("effects that meet", "ours")
@pytest.mark.parametrize("name", ["plain", "tension", "cavity", "snare", "muffle"])
def test_energy_never_grows(name: str) -> None:
    """With losses of its own or its effects', from step to step; rounding is all that may add.

    Every pair of effects, in every scheme: tests/stability/effects/test_every_pair.py.
    """
    engine = struck(scene_of(DRUMS[name], t60_s=0.5), [(0.3, 0.2, 1.0), (-0.4, 0.1, 0.5)])
    last = first = energy(engine)
    for _ in range(300):
        play(engine, int(engine.control["divisor"][0]))
        now = energy(engine)
        assert now <= last + 1e-6 * first
        last = now
    assert last < 0.999 * first


EFFECTS = st.fixed_dictionaries(
    {},
    optional={
        "air": st.builds(
            AirTable, st.floats(0.0, 10.0), st.floats(0.05, 2.0), st.sampled_from(["endless", "none"])
        ),
        "uniform_loss": st.builds(UniformLossTable, st.floats(0.02, 60.0)),
        "internal_loss": st.builds(InternalLossTable, st.floats(0.001, 0.4), st.floats(2100.0, 20000.0)),
        "muffle": st.builds(MuffleTable, st.just(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3))), st.floats(0.001, 10.0)),
        "tension": st.builds(TensionTable, st.floats(0.0, 1200.0)),
        "snare": st.builds(
            SnareTable,
            st.integers(1, 42),
            st.floats(0.1, 50.0),
            st.floats(0.1, 200.0),
            st.floats(0.0, 10.0),
            st.floats(0.005, 10.0),
            st.sampled_from([0.0, 0.05, 1.0]),
        ),
        "cavity": st.builds(
            CavityTable,
            st.floats(0.02, 2.0),
            st.floats(0.05, 2.0),
            st.floats(150.0, 2000.0),
            st.floats(0.02, 60.0),
        ),
    },
)


ANY_DRUM = st.tuples(
    EFFECTS,
    st.floats(300.0, 2000.0),  # a lower one is a larger mesh, of which no step differs
    st.floats(0.5, 60.0),
    st.floats(0.1, 30.0),
    st.sampled_from(["standard", "fine"]),
)


@shows("effects that meet", "ours")
@settings(max_examples=5, suppress_health_check=[HealthCheck.too_slow])
@given(ANY_DRUM)
def test_any_effects_together_decay(drawn: tuple[dict[str, object], float, float, float, str]) -> None:
    """Any values of the tables, by either order, up to thirty times full scale: what is in the drum becomes less."""
    _decays(*drawn)


@shows("effects that meet", "ours")
@pytest.mark.long
@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(ANY_DRUM)
def test_many_more_effects_together_decay(drawn: tuple[dict[str, object], float, float, float, str]) -> None:
    _decays(*drawn)


def _decays(effects: dict[str, object], f01_Hz: float, t60_s: float, share: float, accuracy: str) -> None:
    full = {name: effects.get(name) or DRUM_TABLES[name]() for name in MESH_EFFECTS}
    full["internal_loss"] = effects.get("internal_loss", InternalLossTable(0.4, 2100.0))
    scene = scene_of(full, t60_s=t60_s, f01_Hz=f01_Hz, radius_m=0.02)
    scene = dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, accuracy=accuracy))
    try:
        engine = struck(scene, [(0.3, -0.2, share)])
    except Unplayable as refusal:  # a head as light as its air, or as dull as no wave is
        assert "math domain error" not in str(refusal), refusal
        reject()
    # Of everything together: the first head's own share goes to and fro between it and the others.
    held = [energy(engine)]
    for _ in range(6):
        play(engine, 1000)
        held.append(energy(engine))
    assert np.isfinite(held).all()
    assert all(after <= max(before, 1e-30) * 1.001 for before, after in itertools.pairwise(held)), held


@shows("strong internal loss")
@pytest.mark.parametrize("naive", [False, True])
@pytest.mark.parametrize("uniform_t60_s", [0.02, 0.06, 0.3])
def test_strong_losses_leave_less_room_for_quick_modes(
    naive: bool, uniform_t60_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """q may go to 2 (1 + rho)/(1 + eta (1 + rho)). The limit that holds for rho = 1 alone lets the quickest grow."""
    if naive:
        monkeypatch.setattr(Losses, "most", property(lambda losses: 4.0 / (1.0 + 2.0 * losses.eta)))
    effects: dict[str, object] = {
        "internal_loss": InternalLossTable(0.4, 2100.0),
        "uniform_loss": UniformLossTable(uniform_t60_s),
    }
    engine = struck(scene_of(effects, t60_s=1.0, f01_Hz=150.0), [(0.3, -0.2, 1.0)])
    heights: list[float] = []
    for _ in range(2):
        play(engine, 8000)
        heights.append(float(np.sum(engine.head.time_levels.astype(float) ** 2)))
    assert (heights[1] < heights[0]) == (not naive)


def test_a_pitch_glide_is_as_far_as_the_scene_says() -> None:
    """The mean pull over the first period raises the pitch by the cents asked for; at rest nothing is left of it."""
    for cents in (20.0, 120.0):
        scene = scene_of({"tension": TensionTable(cents)}, t60_s=0.3, f01_Hz=200.0)
        ring = StrikeRing()
        engine, blow = build(scene, RATE, ring), full_scale(scene)  # as stiff as the scene asks for
        ring.push(0, 0.5, 0.0, blow.peak_N, blow.contact_s)
        render_all(engine, np.zeros((round((blow.contact_s + 0.001) * RATE), 2), np.float32), 128, 0)
        assert is_there(engine.effects.tension)
        tau, pulls = float(engine.control["tau"][0]), list[float]()
        for _ in range(round(RATE / 200.0 / float(engine.control["divisor"][0]))):
            play(engine, int(engine.control["divisor"][0]))
            pulls.append(float(engine.effects.tension.state["pull"][0]))
        assert 600.0 * math.log2(1.0 + np.mean(pulls) / tau) == pytest.approx(cents, rel=0.2)
        play(engine, RATE)
        assert abs(float(engine.effects.tension.state["pull"][0])) < 1e-6 * tau


@shows("blow of a million newtons", "ours")
@pytest.mark.parametrize("f01_Hz", [20.0, 150.0, 2000.0])
def test_blows_in_any_place_at_any_speed_never_exceed_full_scale(f01_Hz: float) -> None:
    scene = scene_of({}, t60_s=60.0, f01_Hz=f01_Hz)
    places = np.random.default_rng(2).uniform(-1.5, 1.5, (40, 2))
    strikes = [
        strike_for_speed(scene, 20.0, float(x), float(y), 0.005 * i) for i, (x, y) in enumerate(places)
    ]
    clicks = [OfflineStrike(0.004 * i, 0.3, 0.1, 1e4, 0.0) for i in range(40)]
    sound = render(scene, [*strikes, *clicks], 0.4, RATE)
    assert np.isfinite(sound).all()
    assert 0.5 < np.abs(sound).max() <= 1.0
