"""A mesh in air: its lowest modes have the pitches and decays of the air load's formula."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.internal_loss import InternalLossTable
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.lattice import TOPOLOGIES, lattice_of
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.modal.air_load import in_air
from drumstick.drum.modal.building import decay_rates
from drumstick.drum.modal.modes import shapes_at
from drumstick.parameters.drum import Listen, Modal
from drumstick.parameters.scene import Scene
from membranes import Membrane
from stability.mesh_steps import RATE, take

_HIGHEST = 9.95  # zero j: the twelve lowest modes
_STEPS = 900

Numbers = npt.NDArray[np.float64]


class _Ringing(NamedTuple):
    engine: Engine
    flat: npt.NDArray[np.int64]
    mass: Numbers
    x: Numbers
    y: Numbers


def _scene(f01_Hz: float, radius_m: float, effects: dict[str, object], topology: str = "triangular") -> Scene:
    scene = Scene("drum")
    drum = dataclasses.replace(scene.drum, f01_Hz=f01_Hz, radius_m=radius_m, t60_s=10.0, effects=effects)
    mesh = dataclasses.replace(scene.mesh, rate_Hz=16000.0, topology=topology)
    return dataclasses.replace(scene, drum=drum, mesh=mesh)


def _ringing(scene: Scene) -> _Ringing:
    engine = new_engine(scene, RATE, StrikeRing())
    engine.control["asleep"] = 0
    lattice = lattice_of(float(engine.head.grid["spacing"][0]), TOPOLOGIES[scene.mesh.topology])
    rows, columns = np.nonzero(lattice.weights)
    places = [lattice.position(int(r), int(c)) for r, c in zip(rows, columns, strict=True)]
    flat = (rows * lattice.weights.shape[1] + columns).astype(np.int64)
    mass = Membrane(engine.head, float(engine.control["own_gain"][0])).mass[flat]
    return _Ringing(engine, flat, mass, *np.array(places).T)


def _pole(head: _Ringing, shape: Numbers) -> tuple[float, float]:
    # f in cycles a step, and decay a step, of the head let go in this shape.
    engine, air = head.engine, head.engine.effects.air
    engine.head.time_levels[:] = 0.0
    engine.head.time_levels[:, head.flat] = shape
    air.amplitudes[:] = air.moved.dual @ engine.head.time_levels[0, air.moved.places]  # held still until now
    seen: list[float] = []
    for _ in range(_STEPS):
        take(engine, 1)
        u = engine.head.time_levels[int(engine.control["present_level"][0])]
        seen.append(float(np.sum(head.mass * shape * u[head.flat])))
    a = np.array(seen)
    b, c = np.linalg.lstsq(np.column_stack([a[1:-1], -a[:-2]]), a[2:], rcond=None)[0]
    return math.acos(b / (2.0 * math.sqrt(c))) / (2.0 * math.pi), -0.5 * math.log(c)


_TOM = (114.0, 0.165, {"air": AirTable(1.2, 0.26, "none")})
_TIMPANO = (119.34, 0.328, {"air": AirTable(1.2, 0.262)})


@pytest.mark.parametrize(
    ("f01_Hz", "radius_m", "effects", "topology"),
    [
        (*_TOM, "triangular"),
        (*_TIMPANO, "triangular"),
        (
            114.0,
            0.165,
            {"air": AirTable(1.2, 0.26), "internal_loss": InternalLossTable(0.3, 4000.0)},
            "rectilinear",
        ),
    ],
    ids=["tom without a baffle", "timpano", "dull tom on a square mesh"],
)
def test_the_lowest_modes_sound_as_the_formula_has_them(
    f01_Hz: float, radius_m: float, effects: dict[str, object], topology: str
) -> None:
    """Promised: 25 cents, and a T60 from 25 % less to 40 % more, which nobody hears."""
    scene = _scene(f01_Hz, radius_m, effects, topology)
    head, expected = _ringing(scene), in_air(_HIGHEST, scene.drum)
    steps_per_s = RATE / float(head.engine.control["divisor"][0])
    decays = decay_rates(scene.drum, expected.f_Hz) + expected.decays
    assert len(expected.f_Hz) == 12
    both = np.array(
        [shapes_at(expected.modes, float(x), float(y)) for x, y in zip(head.x, head.y, strict=True)]
    )
    for k, order in enumerate(expected.modes.orders):
        for side in (0, 1) if order else (0,):
            turns, lost = _pole(head, both[:, side, k])
            assert abs(1200.0 * math.log2(turns * steps_per_s / expected.f_Hz[k])) < 3.0
            assert 0.92 < decays[k] / (lost * steps_per_s) < 1.08


def _levels_of_partials(scene: Scene, strike: tuple[float, float], f_Hz: Numbers, decays: Numbers) -> Numbers:
    # Of velocity, in dB, as they begin: all modes fitted at once to what is heard after a known force.
    ring = StrikeRing()
    engine = new_engine(scene, RATE, ring)
    engine.control["output_gain"] = 1e-3  # far from the limiter
    ring.push_blow(OfflineStrike(0.0, *strike, 5.0, 0.0008))
    out = np.zeros((round(0.4 * RATE), 2), np.float32)
    render_all(engine, out, 128, 0)
    heard = out[:, 0].astype(float) * RATE / float(engine.control["divisor"][0])
    part = np.arange(round(0.006 * RATE), round(0.356 * RATE))
    t_s, window = part / RATE, np.hanning(len(part))
    waves = np.exp(np.outer(t_s, 2j * math.pi * f_Hz - decays))
    columns = np.concatenate([waves.real, waves.imag], axis=1) * window[:, None]
    parts = np.linalg.lstsq(columns, heard[part] * window)[0].reshape(2, -1)
    return 20.0 * np.log10(np.hypot(*parts))


@pytest.mark.parametrize("pickup", [(0.43, 0.19), (0.0, 0.3), (-0.6, 0.5)])
@pytest.mark.parametrize("drum", [_TOM, _TIMPANO], ids=["tom", "timpano"])
def test_pickups_hear_the_lowest_partials_as_strong_as_a_bank_of_modes_has_them(
    drum: tuple[float, float, dict[str, object]], pickup: tuple[float, float]
) -> None:
    """To no common factor. The mesh is struck by the shapes that its modes have without air; that is known."""
    strike = (0.3, -0.1)
    scene = _scene(*drum)
    between = dataclasses.replace(scene.drum, inject="linear")  # not at the nearest junction
    meshed = dataclasses.replace(scene, drum=between, listen=Listen(pickups=((*pickup, 0.0),)))
    banked = dataclasses.replace(meshed, modal=Modal(4000.0))
    head = in_air(14.0, meshed.drum)
    decays = decay_rates(meshed.drum, head.f_Hz) + head.decays
    found, bank = (_levels_of_partials(each, strike, head.f_Hz, decays) for each in (meshed, banked))
    alone, there = shapes_at(head.modes, *strike)[0], head.mixed(shapes_at(head.basis, *strike)[0])
    struck = 20.0 * np.log10(np.abs(alone / there))
    moved = head.modes.zeros < _HIGHEST
    strong = np.flatnonzero(moved & (bank > bank[moved].max() - 20.0))
    lowest = strong[np.argsort(head.f_Hz[strong])][:6]
    assert len(lowest) == 6
    assert np.abs((found - bank - struck)[lowest]).max() < 1.5, ((found - bank)[lowest], struck[lowest])


def test_without_density_it_is_the_drum_without_air() -> None:
    """Bit for bit."""
    heard: list[npt.NDArray[np.float32]] = []
    for effects in ({}, {"air": AirTable(0.0)}):
        engine = new_engine(_scene(150.0, 0.16, effects), RATE, StrikeRing())
        engine.control["asleep"] = 0
        engine.head.time_levels[:, engine.head.weights > 0.0] = 1e-3
        take(engine, 200)
        heard.append(engine.head.time_levels.copy())
    assert heard[0].tobytes() == heard[1].tobytes()
