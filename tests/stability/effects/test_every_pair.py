"""The energy of every scheme with every effect: in each step it becomes less, or stays, to rounding."""

import itertools
import math

import numpy as np
import pytest

from drumstick.drum_effects import AirLoss, Cavity, InternalLoss, Muffle, Rim, Snare, Tension
from membranes import energy
from sound_server.engine import Engine
from sound_server.membrane.scheme import Scheme
from stability.catalogue import shows
from stability.mesh_steps import drum_of, engine_of, height, strike, take

# Strong ones: each takes or lends a large part of the energy within the first hundred steps.
EFFECTS: dict[str, object] = {
    "air_loss": AirLoss(0.05),
    "internal_loss": InternalLoss(0.01, 4000.0),
    "muffle": Muffle(((0.4, 0.1, 0.4), (0.9, 0.0, 0.3)), 0.002),
    "tension": Tension(600.0),
    "cavity": Cavity(depth_m=0.02, head_kg_per_m2=0.05, f01_Hz=1700.0, t60_s=60.0),
    "snare": Snare(wires=20, t60_s=10.0, mass=0.5),
    "rim": Rim(),
}
SCHEMES: dict[str, dict[str, object]] = {
    "limit": {},
    "lossless": {"courant": "lossless"},
    "square": {"topology": "rectilinear"},
    "fourth order": {"accuracy": "fine"},
}
_SECOND_ORDER_ONLY = {"internal_loss", "tension", "cavity", "snare"}
PAIRS = list(itertools.combinations(EFFECTS, 2))


def _named(names: tuple[str, ...]) -> dict[str, object]:
    # Wires need a second head to lie on.
    wanted = {*names, "cavity"} if "snare" in names else set(names)
    return {name: effect for name, effect in EFFECTS.items() if name in wanted}


# 2000 Hz is 15 junctions across: the judge is slow.
def _struck(scheme: str, names: tuple[str, ...], f01_Hz: float = 2000.0) -> Engine:
    # A dull head that lost nothing at its lowest pitch would gain by whatever that is off: no scene may ask for it.
    t60_s = 60.0 if "internal_loss" in names else math.inf
    engine = engine_of(drum_of(_named(names), t60_s, f01_Hz, SCHEMES[scheme]))
    for x, y in ((0.3, 0.2), (-0.5, 0.1)):
        strike(engine, 4.0, x, y)
    take(engine, 8)
    return engine


def _most_growth(engine: Engine) -> float:
    # By how much the energy grows from one look to the next, in shares of what it was at first: each step for a while,
    # then now and then.
    held = [energy(engine)]
    for steps in [1] * 60 + [37] * 30:
        take(engine, steps)
        held.append(energy(engine))
    if not np.isfinite(held).all():
        return float("inf")
    assert held[0] > 0.0
    return float(np.max(np.diff(held))) / held[0]


ROUNDING = 2e-6


@shows("effects that meet", "ours")
@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["limit", "lossless", "square"])
@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_no_pair_of_effects_gives_energy(scheme: str, pair: tuple[str, str]) -> None:
    engine = _struck(scheme, pair)
    assert (engine.bend is None) == (scheme != "fourth order")
    assert _most_growth(engine) <= ROUNDING


@shows("effects that meet", "ours")
@pytest.mark.parametrize("pair", [p for p in PAIRS if not _SECOND_ORDER_ONLY & set(p)], ids="+".join)
def test_no_pair_gives_energy_to_the_fourth_order(pair: tuple[str, str]) -> None:
    engine = _struck("fourth order", pair)
    assert engine.bend is not None
    assert _most_growth(engine) <= ROUNDING


@shows("effects that meet")
@pytest.mark.parametrize("naive", [False, True])
@pytest.mark.parametrize("scheme", ["limit", "square"])
def test_all_effects_at_once_find_room_for_each_other(
    scheme: str, naive: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a very dull head. The naive mesh is at the limit that it has without effects, and overflows."""
    if naive:
        monkeypatch.setattr(Scheme, "squeezed", lambda scheme, most: scheme)
    monkeypatch.setitem(EFFECTS, "internal_loss", InternalLoss(0.001, 4000.0))
    engine = _struck(scheme, tuple(EFFECTS), f01_Hz=1000.0)  # or so dull a head has too few junctions
    first = height(engine)
    if naive:
        take(engine, 3000)
        assert not height(engine) < 1e6 * first
    else:
        assert _most_growth(engine) <= ROUNDING
        assert height(engine) <= first
