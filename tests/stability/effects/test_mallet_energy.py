"""Mallets on a drum with every effect: no step in which they meet the head makes energy."""

import dataclasses
import math

import numpy as np
import pytest

from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.rim import RimTable
from drumstick.drum.effects.snare import SnareTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.engine import Engine, set_live
from drumstick.parameters.drum import Modal
from mallets import joules, start_mallet, with_mallet
from realtime.records import is_there
from stability.catalogue import shows
from stability.mesh_steps import drum_of, engine_of, take

EFFECTS: dict[str, object] = {
    "air": AirTable(2.0, 0.1),
    "internal_loss": InternalLossTable(0.05, 4000.0),
    "muffle": MuffleTable(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3)), 0.005),
    "tension": TensionTable(600.0),
    "cavity": CavityTable(depth_m=0.05, head_kg_per_m2=0.26, f01_Hz=1700.0, t60_s=60.0),
    "snare": SnareTable(wires=20, g_per_m=20.0, t60_s=10.0),
    "rim": RimTable(),
}
DRUMS: dict[str, tuple[str, ...]] = {
    "plain": (),
    "internal_loss": ("internal_loss",),
    "muffle": ("muffle",),
    "tension": ("tension",),
    "air": ("air",),
    "air+tension": ("air", "tension"),
    "tension+muffle+internal_loss": ("tension", "muffle", "internal_loss"),
    "all": tuple(EFFECTS),
}
TIPS: dict[str, dict[str, float]] = {
    "wood": {},
    "felt": {
        "mass_kg": 0.03,
        "stiffness_N_per_m_p": 2e8,
        "exponent": 2.5,
        "loss_s_per_m": 0.8,
        "tip_radius_m": 0.02,
    },
    "hard and heavy": {"mass_kg": 0.2, "stiffness_N_per_m_p": 1e12, "exponent": 1.7, "loss_s_per_m": 0.0},
}
STRIKES = 20
# Of the energy of a strike in one step: float32's rounding of the head's heights.
ROUNDING = 2e-6


def _drum(effects: tuple[str, ...], tip: str, mesh: dict[str, object] | None = None) -> Engine:
    t60_s = 60.0 if "internal_loss" in effects else math.inf
    f01_Hz = 1000.0 if "air" in effects else 2000.0
    radius_m = 0.04 if "air" in effects else 0.16
    scene = drum_of({name: EFFECTS[name] for name in effects}, t60_s, f01_Hz, mesh, radius_m=radius_m)
    return engine_of(with_mallet(scene, **TIPS[tip]))


def _most_growth(engine: Engine, strikes: int, seed: int = 3) -> float:
    # Strikes before the last ones are over, in any place, again in the same one, and on the rim.
    assert engine.mallets is not None
    chance = np.random.default_rng(seed)
    worst, x, y, pushed, largest, held = 0.0, 0.3, 0.2, False, 0.0, 0.0
    for _ in range(strikes):
        if chance.random() < 0.7:
            x, y = chance.uniform(-1.0, 1.0, 2)
        start_mallet(engine, float(10.0 ** chance.uniform(-1.0, 1.3)), x, y, -float(chance.random()))
        take(engine, 1)  # it arrives, with what it has
        held = joules(engine)
        largest = max(largest, held)
        for _ in range(int(chance.integers(2, 40))):
            take(engine, 1)
            now = joules(engine)
            worst = max(worst, (now - held) / largest)
            held = now
            pushed = pushed or bool((engine.mallets.pool["force"] > 0.0).any())
    assert pushed
    assert np.isfinite(held)
    return worst


@shows("mallet on the head", "ours")
@pytest.mark.parametrize("tip", TIPS)
@pytest.mark.parametrize("names", DRUMS)
@pytest.mark.daily("all-felt")
def test_no_step_of_a_mallet_on_a_drum_makes_energy(names: str, tip: str) -> None:
    assert _most_growth(_drum(DRUMS[names], tip), STRIKES) <= ROUNDING


def _growth_of_a_muffle_that_jumps(engine: Engine, masses_follow: bool = True) -> tuple[float, int]:
    # Of the energy of a stroke, over four strokes and the time after each; and how often the muffle moved.
    assert engine.mallets is not None
    muffle, tension = engine.effects.muffle, engine.effects.tension
    muffle.state["most"] = 1.0  # the whole way in one step, as no set can make it
    chance = np.random.default_rng(4)
    as_built = tension.share.copy() if is_there(tension) else None
    worst, moves, pressed = 0.0, 0, 1.0
    for _ in range(4):
        start_mallet(engine, 3.0, *chance.uniform(-0.6, 0.6, 2))
        take(engine, 1)
        held = largest = joules(engine)
        after = 0
        while after < 200:
            after += int(engine.mallets.state["begun"][0] == engine.mallets.state["oldest"][0])
            set_live(engine, "muffle", float(chance.choice([0.0, 0.1, 1.0])))
            if as_built is not None and not masses_follow:
                tension.share[:] = as_built
            take(engine, 1)
            now = joules(engine)
            worst, held = max(worst, (now - held) / largest), now
            moves += int(muffle.state["press"][0] != pressed)
            pressed = float(muffle.state["press"][0])
    return worst, moves


@shows("muffle set while it plays", "ours")
@pytest.mark.parametrize("names", ["muffle", "tension+muffle+internal_loss", "all"])
@pytest.mark.daily("tension*")
def test_nor_does_a_muffle_that_jumps_while_it_plays(names: str) -> None:
    worst, moves = _growth_of_a_muffle_that_jumps(_drum(DRUMS[names], "wood"))
    assert worst <= ROUNDING
    assert moves > 200


@shows("muffle set while it plays", "naive")
def test_masses_as_they_were_built_make_energy_under_a_muffle_that_jumps() -> None:
    engine = _drum(DRUMS["tension+muffle+internal_loss"], "wood")
    worst, _ = _growth_of_a_muffle_that_jumps(engine, masses_follow=False)
    assert worst > 10.0 * ROUNDING


@shows("mallet on the head", "ours")
@pytest.mark.long
def test_nor_on_a_square_mesh() -> None:
    assert _most_growth(_drum((), "wood", {"topology": "rectilinear"}), STRIKES) <= ROUNDING


@shows("mallet on the head", "ours")
@pytest.mark.parametrize("names", DRUMS)
@pytest.mark.daily("all")
def test_nor_to_the_fourth_order(names: str) -> None:
    engine = _drum(DRUMS[names], "wood", {"accuracy": "fine"})
    assert engine.laplacian is not None
    assert _most_growth(engine, STRIKES) <= ROUNDING


@pytest.mark.long
@shows("mallet on the head", "ours")
def test_nor_on_a_square_mesh_under_tension() -> None:
    assert _most_growth(_drum(("tension",), "wood", {"topology": "rectilinear"}), STRIKES) <= ROUNDING


MODES: dict[str, tuple[float, float, dict[str, object]]] = {
    "few modes": (400.0, math.inf, {}),
    "many modes": (10_000.0, math.inf, {}),
    "with losses": (
        6000.0,
        0.5,
        {
            "uniform_loss": UniformLossTable(2.0),
            "internal_loss": InternalLossTable(0.1, 1000.0),
            "rim": RimTable(),
        },
    ),
    "under tension": (6000.0, math.inf, {"tension": TensionTable(600.0)}),
}


@pytest.mark.daily("*felt")
@shows("mallet on the head", "ours")
@pytest.mark.parametrize("tip", TIPS)
@pytest.mark.parametrize("bank", MODES)
def test_nor_on_a_bank_of_modes(bank: str, tip: str) -> None:
    top_Hz, t60_s, effects = MODES[bank]
    scene = dataclasses.replace(drum_of(effects, t60_s, 150.0), modal=Modal(top_Hz))
    engine = engine_of(with_mallet(scene, **TIPS[tip]))
    assert _most_growth(engine, 60) <= ROUNDING


def _pushed_by_where_it_is(stiffness: float, exponent: float) -> float:
    # A blow of 1 m/s on a head of two junctions' mass, by the push at the beginning of each step: energy at last, to
    # what there was.
    step_s, mass, head = 1.0 / 48_000.0, 0.01, 0.001
    x, x_before, y, y_before = 0.0, -step_s, 0.0, 0.0
    for _ in range(2000):
        push = stiffness * max(x - y, 0.0) ** exponent
        x, x_before = 2.0 * x - x_before - step_s**2 / mass * push, x
        y, y_before = 2.0 * y - y_before - 1e-4 * y + step_s**2 / head * push, y
    last = 0.5 * mass * (x - x_before) ** 2 + 0.5 * head * ((y - y_before) ** 2 + 1e-4 * y * y_before)
    return last / step_s**2 / (0.5 * mass)


@shows("mallet on the head", "naive")
def test_a_push_by_where_the_tip_is_throws_it_back_faster_than_it_came() -> None:
    assert _pushed_by_where_it_is(1e5, 1.5) < 1.1  # soft, it hardly shows
    assert _pushed_by_where_it_is(1e10, 1.5) > 100.0


def test_without_losses_all_of_it_is_there_at_last() -> None:
    """Energy of a wooden mallet without loss: all of it is in the head and in the mallet that leaves it."""
    engine = engine_of(with_mallet(drum_of({}, math.inf, 1000.0), loss_s_per_m=0.0))
    assert engine.mallets is not None
    start_mallet(engine, 1.0)
    take(engine, 1)
    first, touched = joules(engine), 0
    for _ in range(200):
        take(engine, 1)
        touched += int(engine.mallets.pool["force"][0] > 0.0)
        if engine.mallets.pool["stage"][0]:
            assert joules(engine) == pytest.approx(first, rel=1e-5)
    assert touched > 5
