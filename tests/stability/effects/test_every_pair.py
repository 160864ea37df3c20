"""The energy of every scheme with every effect: in each step it becomes less, or stays, to rounding."""

import itertools
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
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.scheme import Scheme
from membranes import energy
from stability.catalogue import shows
from stability.mesh_steps import drum_of, engine_of, height, strike, take

# Strong ones: each takes or lends a large part of the energy within the first hundred steps.
EFFECTS: dict[str, object] = {
    "air": AirTable(3.0, 0.1),
    "uniform_loss": UniformLossTable(0.05),
    "internal_loss": InternalLossTable(0.01, 4000.0),
    "muffle": MuffleTable(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3)), 0.002),
    "tension": TensionTable(600.0),
    "cavity": CavityTable(depth_m=0.02, head_kg_per_m2=0.05, f01_Hz=1700.0, t60_s=60.0),
    "snare": SnareTable(wires=20, g_per_m=20.0, t60_s=10.0),
    "rim": RimTable(),
}
SCHEMES: dict[str, dict[str, object]] = {
    "limit": {
        "rate_Hz": 48_000.0
    },  # by hand: of second order also for a head that would not be in tune by it
    "lossless": {"courant": "lossless"},
    "square": {"topology": "rectilinear"},
    "fourth order": {"accuracy": "fine"},
}
# As weak as a scene can ask for them.
WEAKEST: dict[str, object] = {
    "air": AirTable(0.001, 2.0, "none"),
    "uniform_loss": UniformLossTable(60.0),
    "internal_loss": InternalLossTable(60.0, 20000.0),
    "muffle": MuffleTable(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3)), 10.0),
    "tension": TensionTable(0.0),
    "cavity": CavityTable(
        depth_m=2.0, head_kg_per_m2=2.0, f01_Hz=1700.0, t60_s=60.0
    ),  # a lower one is a larger mesh
    "snare": SnareTable(wires=1, g_per_m=0.1, bed_mm=0.0, t60_s=10.0),
    "rim": RimTable(level=0.0),
}
PAIRS = list(itertools.combinations(EFFECTS, 2))


def _named(names: tuple[str, ...]) -> dict[str, object]:
    # Wires need a second head to lie on.
    wanted = {*names, "cavity"} if "snare" in names else set(names)
    return {name: effect for name, effect in EFFECTS.items() if name in wanted}


# 2000 Hz is 15 junctions across: the judge is slow. So high a head in air has to be small, and it needs more junctions.
def _struck(scheme: str, effects: dict[str, object], f01_Hz: float = 2000.0) -> Engine:
    f01_Hz = min(f01_Hz, 1000.0) if "air" in effects else f01_Hz
    # A dull head that lost nothing at its lowest pitch would gain by whatever that is off: no scene may ask for it.
    t60_s = 60.0 if "internal_loss" in effects else math.inf
    engine = engine_of(drum_of(effects, t60_s, f01_Hz, SCHEMES[scheme], radius_m=0.04))
    for x, y in ((0.3, 0.2), (-0.5, 0.1)):
        strike(engine, 4.0, x, y)
    take(engine, 8)
    return engine


def _most_growth(engine: Engine, looks: list[int]) -> float:
    # By how much the energy grows from one look to the next, in shares of what it was; `looks`: steps between them.
    held = [energy(engine)]
    for steps in looks:
        take(engine, steps)
        held.append(energy(engine))
    if not np.isfinite(held).all():
        return float("inf")
    assert held[0] > 0.0
    # Near nothing float32 has no digits left to lose.
    return float(np.max(np.diff(held) / np.maximum(held[:-1], 1e-6 * held[0])))


EACH_STEP = [1] * 60 + [37] * 30
NOW_AND_THEN = [1] * 4 + [31] * 8
LONG = [100_000, 1, 100_000]
ROUNDING = 2e-6


@shows("effects that meet", "ours")
@pytest.mark.long
@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_no_pair_of_effects_gives_energy(pair: tuple[str, str]) -> None:
    """Compiled for these two alone. The lossless scheme is the same code with other numbers."""
    for scheme in ("limit", "lossless"):
        engine = _struck(scheme, _named(pair))
        assert engine.laplacian is None
        assert _most_growth(engine, EACH_STEP) <= ROUNDING


@shows("effects that meet", "ours")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.long
def test_no_combination_of_strong_and_weak_effects_gives_energy(scheme: str) -> None:
    """Every one of 128: each effect strong, or as weak as can be. The rim is in all of them."""
    others = [name for name in EFFECTS if name != "rim"]
    for size in range(len(others) + 1):
        for strong in itertools.combinations(others, size):
            effects = {name: (EFFECTS if name in (*strong, "rim") else WEAKEST)[name] for name in EFFECTS}
            assert _most_growth(_struck(scheme, effects), NOW_AND_THEN) <= ROUNDING, strong


@pytest.mark.daily("limit")
@shows("effects that meet", "ours")
@pytest.mark.parametrize("scheme", SCHEMES)
def test_all_effects_at_their_weakest_give_no_energy_for_long(scheme: str) -> None:
    """Growth shows where next to nothing is lost: one that a few thousand steps hide comes to light."""
    assert _most_growth(_struck(scheme, WEAKEST), LONG) <= ROUNDING


@pytest.mark.long
@shows("effects that meet", "ours")
@pytest.mark.parametrize(
    "names",
    [
        names
        for n in (1, 2, 3)
        for names in itertools.combinations(["internal_loss", "muffle", "tension", "cavity", "air"], n)
    ],
    ids="+".join,
)
def test_no_effects_together_give_energy_to_the_fourth_order(names: tuple[str, ...]) -> None:
    """Each, each two and each three of those that its sweeps know of, compiled for these alone."""
    engine = _struck("fourth order", _named(names))
    assert engine.laplacian is not None
    assert _most_growth(engine, EACH_STEP) <= ROUNDING


@shows("effects that meet")
@pytest.mark.parametrize("naive", [False, True])
@pytest.mark.parametrize("scheme", ["limit", "square", "fourth order"])
def test_all_effects_at_once_find_room_for_each_other(
    scheme: str, naive: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a very dull head. The naive mesh is at the limit that it has without effects, and overflows."""
    if naive:
        monkeypatch.setattr(Scheme, "squeezed", lambda scheme, *_: scheme)
    monkeypatch.setitem(EFFECTS, "internal_loss", InternalLossTable(0.001, 4000.0))
    engine = _struck(scheme, EFFECTS, f01_Hz=1000.0)  # or so dull a head has too few junctions
    first = height(engine)
    if naive:
        take(engine, 3000)
        assert not height(engine) < 1e6 * first
    else:
        assert _most_growth(engine, EACH_STEP) <= ROUNDING
        assert height(engine) <= first
