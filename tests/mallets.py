"""Mallets for tests: on a wall, on three oscillators that hold on to each other, and what they hold on a drum."""

import dataclasses
import math
from typing import Any

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.engine import Engine
from drumstick.drum.mallets import mallet
from drumstick.drum.mallets.tip import advance_tip, reset_tip, solve_contact
from drumstick.drum.memory.bank import Bank
from drumstick.drum.memory.mallets import TIP, Tip
from drumstick.drum.memory.strikes import EVENT, StrikeRing
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from membranes import energy, is_triangular, of_tension
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit
from realtime.records import Records, is_there

_RATE = 48_000


def tip_of(stiffness: float, exponent: float, loss: float, step_s: float, compliance: float) -> Tip:
    """A tip's record, out of touch."""
    tip: Any = np.zeros(1, TIP)
    twice_exponent = 2.0 * exponent
    tip["stiffness"], tip["exponent"], tip["compliance"] = stiffness, exponent, compliance
    tip["twice_exponent"] = round(twice_exponent) if twice_exponent == round(twice_exponent) else 0
    tip["energy_factor"] = 1.0 / (exponent + 1.0)
    tip["loss_rate"] = loss / (2.0 * step_s)
    return tip[0]


def touched_s(scene: Scene, speed: float, x: float) -> float:
    """From the first push of one blow to its last."""
    ring = StrikeRing()
    engine = new_engine(scene, _RATE, ring)
    assert engine.mallets is not None
    ring.push_blow(strike_for_speed(scene, speed, x, 0.0))
    steps_s = float(engine.control["divisor"][0]) / _RATE
    step, pushed = np.zeros((int(engine.control["divisor"][0]), 2), np.float32), list[bool]()
    for _ in range(round(0.03 / steps_s)):
        render_all(engine, step, len(step), 0)
        pushed.append(bool(engine.mallets.pool["force"][0] > 0.0))
    at = np.flatnonzero(pushed)
    return float(at[-1] - at[0] + 1) * steps_s


@njit()
def on_a_wall(tips: Records, mass: float, speed: float, step_s: float) -> tuple[float, float]:
    """One blow on what does not move: how long the tip is pressed in, s, and the speed after it over that before.

    Both ends of the contact lie between two steps: where the straight line through them leaves the wall.
    """
    tip = tips[0]
    tip.compliance = step_s * step_s / mass
    x, before = 0.0, -speed * step_s
    reset_tip(tip, x, before)
    contact = 0.0
    while x > 0.0 or x >= before:
        after, _ = solve_contact(tip, 2.0 * x - before)
        advance_tip(tip, after)
        before, x = x, after
        contact += step_s
    contact -= step_s * x / (x - before)
    for _ in range(2):  # the push of the last steps stands for depths before them
        after, _ = solve_contact(tip, 2.0 * x - before)
        advance_tip(tip, after)
        before, x = x, after
    return contact, (before - x) / (speed * step_s)


@njit()
def _stored(q: Any, before: Any, square: Any, mass: float) -> float:
    # Of three oscillators in a ring, each on its own spring and on its neighbours': J over T^2.
    found = 0.0
    for i in range(3):
        j = (i + 1) % 3
        moved = q[i] - before[i]
        apart, apart_before = q[i] - q[j], before[i] - before[j]
        found += (
            0.5 * mass * (moved * moved + square[i] * q[i] * before[i] + square[3] * apart * apart_before)
        )
    return found


@njit()
def struck_at_random(tips: Records, strikes: int, seed: int) -> tuple[float, float, int, int]:
    """Random blows of random mallets on three oscillators, the next before the last one is forgotten.

    Returns the largest rise of energy in one step, to what there was at the beginning of that blow; the largest change
    of energy in all, which tells that something went on; how many touches there were; and how many blows began while
    the tip was pressed in.
    """
    np.random.seed(seed)
    tip = tips[0]
    q, before, free = np.zeros(3), np.zeros(3), np.zeros(3)
    share, square = np.zeros(3), np.zeros(4)
    worst, moved_most, touches, pressed = 0.0, 0.0, 0, 0
    mass = 1.0
    for strike in range(strikes):
        if strike % 8 == 0:  # another head, at rest
            q[:] = 0.0
            before[:] = 0.0
            mass = 10.0 ** np.random.uniform(-3.0, 0.0)
            for i in range(4):
                square[i] = 10.0 ** np.random.uniform(-4.0, -0.4)
            for i in range(3):
                share[i] = np.random.uniform(0.0, 1.0)
            share /= share.sum()
        step_s = 10.0 ** np.random.uniform(-5.0, -4.0)
        own = 10.0 ** np.random.uniform(-3.0, 0.0)
        speed = 10.0 ** np.random.uniform(-2.0, 1.3)
        twice_exponent = np.random.randint(2, 9)
        tip.exponent, tip.twice_exponent = 0.5 * twice_exponent, twice_exponent
        if np.random.random() < 0.2:
            tip.exponent, tip.twice_exponent = np.random.uniform(1.0, 4.0), 0
        tip.energy_factor = 1.0 / (tip.exponent + 1.0)
        # As stiff as the depth it is pressed in says, from a nanometre to ten centimetres.
        depth = 10.0 ** np.random.uniform(-9.0, -1.0)
        tip.stiffness = 0.5 * own * speed * speed * (tip.exponent + 1.0) / depth ** (tip.exponent + 1.0)
        tip.loss_rate = (
            0.0 if np.random.random() < 0.3 else 10.0 ** np.random.uniform(-2.0, 1.5) / (2.0 * step_s)
        )
        tip.compliance = step_s * step_s / own
        y, y_before = 0.0, 0.0
        for i in range(3):
            tip.compliance += share[i] * share[i] * step_s * step_s / mass
            y += share[i] * q[i]
            y_before += share[i] * before[i]
        x = min(y - np.random.random() * speed * step_s, y_before + speed * step_s)
        x_before = x - speed * step_s
        if tip.depth > 0.0:
            pressed += 1
        reset_tip(tip, x - y, x_before - y_before)
        inverse = 1.0 / (step_s * step_s)
        held = inverse * (_stored(q, before, square, mass) + 0.5 * own * (x - x_before) ** 2)
        first = held
        touched = False
        for _ in range(np.random.randint(3, 120)):
            y_free = 0.0
            for i in range(3):
                pull = square[i] * q[i] + square[3] * (2.0 * q[i] - q[(i + 1) % 3] - q[(i + 2) % 3])
                free[i] = 2.0 * q[i] - before[i] - pull
                y_free += share[i] * free[i]
            x_free = 2.0 * x - x_before
            after, force = solve_contact(tip, x_free - y_free)
            for i in range(3):
                before[i] = q[i]
                q[i] = free[i] + share[i] * step_s * step_s / mass * force
            x_before = x
            x = x_free - step_s * step_s / own * force
            advance_tip(tip, after)
            if force < 0.0:
                worst = math.inf  # it pulled
            if force > 0.0 and not touched:
                touches += 1
            touched = force > 0.0
            now = inverse * (_stored(q, before, square, mass) + 0.5 * own * (x - x_before) ** 2)
            now += 0.5 * (tip.energy + tip.energy_before)
            worst = max(worst, (now - held) / first)
            held = now
        moved_most = max(moved_most, 1.0 - held / first)
    return worst, moved_most, touches, pressed


def with_mallet(scene: Scene, **numbers: Any) -> Scene:
    """The same scene with its drum struck by mallets: the default one, but for these numbers."""
    drum = dataclasses.replace(scene.drum, excitation="mallet")
    return dataclasses.replace(scene, drum=drum, mallet=Mallet(**numbers))


def start_mallet(engine: Engine, speed: float, x: float = 0.3, y: float = 0.2, age: float = 0.0) -> None:
    """A strike from the next step on."""
    event: Any = np.zeros(1, EVENT)
    event["speed_m_per_s"], event["x"], event["y"] = speed, x, y
    _start_mallet(engine, event, age)
    engine.control["asleep"] = 0


@njit()
def _start_mallet(engine: Engine, events: Records, age: float) -> bool:
    return mallet.start(borrowed_view(engine), events[0], age)


def of_mallets(engine: Engine) -> float:
    """Kinetic energy of all mallets that play, and what their tips hold, J."""
    assert engine.mallets is not None
    plays = engine.mallets.pool["stage"] == mallet.PLAYING
    pool, tips = engine.mallets.pool[plays], engine.mallets.tips[plays]
    moved = pool["now"] - pool["before"]
    return float(
        np.sum(0.5 * moved**2 / pool["own_compliance"] + 0.5 * (tips["energy"] + tips["energy_before"]))
    )


def _of_modes(bank: Bank) -> float:
    # What drumstick.drum.mallets.shares says a bank holds, in its own units.
    assert bank.masses is not None
    q, d, r_squared, stiffness = (
        values.astype(float) for values in (bank.q, bank.d, bank.r_squared, bank.stiffness)
    )
    square = 2.0 * stiffness / (1.0 + r_squared)
    mass = bank.masses * (1.0 + r_squared) / (2.0 * r_squared)
    return float(np.sum(0.5 * mass * (d**2 + square * q * (q - d))))


def in_bank(engine: Engine) -> float:
    """Energy of a bank of modes and of its tension, in the bank's own units."""
    bank = engine.modal
    assert bank is not None
    held = _of_modes(bank)
    if is_there(engine.effects.tension):
        assert bank.stretch_weights is not None
        q, d = bank.q.astype(float), bank.d.astype(float)
        held += of_tension(engine.effects.tension, float(np.sum(bank.stretch_weights * q * (q - d))))
    return held


def joules(engine: Engine) -> float:
    """All that is in a mesh, or a bank of modes, and in the mallets that play on it."""
    assert engine.mallets is not None
    if engine.modal is not None:
        return in_bank(engine) * float(engine.mallets.state["unit_m"][0]) + of_mallets(engine)
    height = 0.75**0.5 if is_triangular(engine.head) else 1.0
    unit = float(engine.mallets.state["unit_m"][0]) * 4.0 * height / float(engine.control["tau"][0])
    return unit * energy(engine) + of_mallets(engine)
