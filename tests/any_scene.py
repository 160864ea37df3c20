"""Hypothesis strategies over everything that the tables' ranges allow: evenly over the decades, the limits included.

`scenes` are whole scenes of any values. `likely_scenes` are those that a musician might set, where most of what effects
do to each other happens; a uniform choice over all ranges would seldom make a second contact.
"""

import dataclasses
import functools
import math
from typing import Any

from hypothesis import strategies as st

from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.effects.registry import STICK_TABLES

# Every effect stands in at least one of these; each tuple is a record type, compiled once for the whole suite.
COMBINATIONS: dict[str, tuple[str, ...]] = {
    "none": (),
    "pulse": ("pulse",),
    "cor_pulse": ("cor_pulse",),
    "system_delay": ("system_delay",),
    "head": ("hysteretic_spring", "negative_damping", "noise", "chaos"),
    "all": tuple(STICK_TABLES),
}


def over(quantity: Quantity) -> st.SearchStrategy[float]:
    """Values of one quantity. Uniform numbers would never try a small one."""
    if quantity.kind is int:
        return st.integers(int(quantity.low), int(quantity.high))
    smallest = max(quantity.low, 1e-9)
    logarithmic = st.floats(math.log(smallest), math.log(quantity.high)).map(
        lambda x: min(max(math.exp(x), quantity.low), quantity.high)
    )
    limits = st.sampled_from([quantity.low, quantity.high])
    return logarithmic | logarithmic.map(lambda x: max(-x, quantity.low)) | limits


@functools.cache  # hypothesis looks a strategy over before it is first drawn from, which takes longer than to draw
def tables(kind: type) -> st.SearchStrategy[Any]:
    """Whole tables of one kind."""
    fields: dict[str, st.SearchStrategy[object]] = {}
    for key, quantity in quantities(kind).items():
        fields[key] = st.sampled_from(quantity.choices) if quantity.choices else over(quantity)
    return st.builds(kind, **fields)


STICKS, PULSES = tables(Stick), tables(Pulse)


def _effects(names: tuple[str, ...]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({name: tables(STICK_TABLES[name]) for name in names})


def scenes(names: tuple[str, ...]) -> st.SearchStrategy[Scene]:
    """Scenes with these effects, any values."""
    return st.builds(Scene, st.just("any"), stick=STICKS, effects=_effects(names))


def _decades(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


_MASSES, _CONTACTS = _decades(1e-3, 0.3), _decades(3e-4, 5e-2)
_ZETAS = st.just(0.0) | st.floats(0.0, 0.5) | _decades(1e-3, 2.0)
_HANDS = st.just(0.0) | _decades(1e-4, 3.0)
_RETURNS = st.just(0.0) | st.floats(0.0, 1.0)
_SIDES, _HEIGHTS = st.sampled_from([-1.0, -1.0, -1.0, 0.0, 1.0]), _decades(1e-4, 0.3)
_RELEASES = st.sampled_from(["paper", "unilateral"])


@st.composite
def likely_sticks(draw: st.DrawFn) -> Stick:
    """A contact of 0.3 to 50 ms, from no damping to beyond critical, a hand that presses, lifts or is not there."""
    m, contact_s = draw(_MASSES), draw(_CONTACTS)
    k_coll = min(m * (math.pi / contact_s) ** 2, 1e6)
    r_in = min(2.0 * draw(_ZETAS) * math.sqrt(m * k_coll), 1e3)
    k_hand = min(k_coll * draw(_HANDS), 1e4)
    r_out = r_in * draw(_RETURNS)
    z_ss = draw(_SIDES) * draw(_HEIGHTS)
    return Stick(m, k_coll, r_in, k_hand, r_out, z_ss, draw(_RELEASES))


# By which number each effect is strong, and its value where it does nothing.
_STRENGTH = {
    "pulse": ("dv_m_per_s", 0.0),
    "cor_pulse": ("gamma", 0.0),
    "system_delay": ("period_s", 1e-4),
    "hysteretic_spring": ("ratio", 1.0),
    "negative_damping": ("r_N_s_per_m", 0.0),
    "noise": ("force_N", 0.0),
    "chaos": ("force_N", 0.0),
}


def eased(scene: Scene) -> Scene:
    """The same scene, with each effect half as strong."""
    effects: dict[str, Any] = {}
    for name, effect in scene.effects.items():
        key, neutral = _STRENGTH[name]
        effects[name] = dataclasses.replace(effect, **{key: neutral + 0.5 * (getattr(effect, key) - neutral)})
    return dataclasses.replace(scene, effects=effects)


# Forces, times and a damper as shares of the contact's own: `_of_contact`.
_FORCES = st.just(0.0) | _decades(1e-3, 1.0)
_LIKELY: dict[str, st.SearchStrategy[dict[str, Any]]] = {
    name: st.fixed_dictionaries(values)
    for name, values in {
        "pulse": {"dv_m_per_s": st.just(0.0) | _decades(1e-3, 3.0), "tau_s": _decades(1e-4, 1.0)},
        "cor_pulse": {"gamma": st.just(0.0) | st.floats(0.0, 1.0), "tau_s": _decades(1e-4, 0.3)},
        "system_delay": {
            "period_s": st.floats(3e-3, 1.0),
            "delay_ticks": st.sampled_from([0, 0, 1, 1, 2, 3, 8]),
        },
        "hysteretic_spring": {"ratio": st.just(1.0) | st.floats(1.0, 4.0)},
        "negative_damping": {
            "r_N_s_per_m": st.floats(0.0, 3.0),
            "below_m_per_s": st.just(0.0) | _decades(1e-3, 3.0),
        },
        "noise": {"force_N": _FORCES, "hold_s": st.floats(0.05, 2.0)},
        "chaos": {"force_N": _FORCES, "growth": st.sampled_from([0.0, 3.9, 4.0]) | st.floats(0.0, 4.0)},
    }.items()
}


def _of_contact(stick: Stick, values: dict[str, Any]) -> dict[str, Any]:
    contact_s = math.pi * math.sqrt(stick.m_kg / stick.k_coll_N_per_m)
    impedance = math.sqrt(stick.m_kg * stick.k_coll_N_per_m)
    units = {
        "period_s": (contact_s, 1e-4, 0.02),
        "hold_s": (contact_s, 1e-4, 0.1),
        "r_N_s_per_m": (stick.r_in_N_s_per_m, 0.0, 1e3),
        "force_N": (impedance, 0.0, 100.0),
    }
    found = dict(values)
    for key in units.keys() & values.keys():
        unit, low, high = units[key]
        found[key] = min(max(values[key] * unit, low), high)
    return found


@st.composite
def likely_scenes(draw: st.DrawFn, names: tuple[str, ...]) -> Scene:
    """Scenes with these effects, each about as strong as the contact that it alters."""
    stick = draw(likely_sticks())
    effects = {
        name: dataclasses.replace(draw(tables(STICK_TABLES[name])), **_of_contact(stick, draw(_LIKELY[name])))
        for name in names
    }
    return Scene("likely", stick=stick, effects=effects)
