"""Conformance of an effect of the stick: what a search over its values, sticks and hands finds against it."""

import math
import random
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import Quantity, quantities
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import all_effects, envelope
from drumstick.scenes.table import table_of
from drumstick.stick import composition
from drumstick.stick.effects import registry
from drumstick.stick.effects.own_effect import Effect
from drumstick.stick.law import law_of, law_type, motion_type, thrown
from drumstick.stick.motion import exact, transitions
from drumstick.stick.records import Law, Motion, field_of
from drumstick.testing.rules import NotConforming, compiled_rules, declared, require_no_allocation
from realtime.kernels.folding import added, folded
from realtime.kernels.jit import njit
from realtime.records import Record, Rows, dtype_of

_LASTS_S = 0.5
_TICK_S = 1e-3
_CONTACTS = 8  # compared of each run
_MOST_STEPS = 20_000
_SOME = 20  # scenes
_ASKED = 4  # times for its bound
_ROUNDING = 1.0 + 1e-9
_WELL = 1e-3  # of the speed of a contact: a stick that leaves slower may as well not leave
_SAME = 1e-6  # of a speed or a time, when a run is cut into ticks


class _Seen(Record):
    """The worst of a run: how far each value was beyond its bound; the fastest and the hardest; 1 where not finite,
    and where the largest force is another one when it is asked for again.
    """

    force_N: float
    stiffness: float
    damping_N_s_per_m: float
    added_m_per_s: float
    follows_N: float
    fastest_m_per_s: float
    hardest_N: float
    not_finite: int
    bound_moves: int
    contacts: int


@folded(registry.EFFECTS, added, hook="asked_force")
def _asked_force(law: Law, motion: Motion) -> float:
    # What an effect of another package asks for, before it is cut to its bound.
    return composition.force(law, motion)


@njit()
def _in_head(law: Law, motion: Motion, seen: _Seen) -> None:
    force = _asked_force(law, motion)
    seen.force_N = max(seen.force_N, abs(force) - all_effects.max_force(law))
    seen.stiffness = max(
        seen.stiffness, composition.stiffening(law, motion) - all_effects.max_stiffening(law)
    )
    least = all_effects.slow_damping(law) if -motion.v_in < all_effects.slow_speed(law) else law.r_in
    damping = law.r_in - composition.removed_damping(law, motion)
    seen.damping_N_s_per_m = max(seen.damping_N_s_per_m, least - damping)
    z, v = motion.z, motion.v
    motion.z, motion.v = 0.5 * z, v + 1.0
    seen.follows_N = max(seen.follows_N, abs(_asked_force(law, motion) - force))
    motion.z, motion.v = z, v
    if not abs(force) < math.inf:
        seen.not_finite = 1


@njit()
def _play(
    law: Law,
    motion: Motion,
    lasts_s: float,
    step_s: float,
    seen: _Seen,
    contacts: npt.NDArray[np.float64],
) -> None:
    # Play in steps. contacts: time, speed in, speed out and peak of the first ones.
    t, steps, fresh_N = 0.0, 0, 0.0
    bound_N = all_effects.max_force(law)
    for _ in range(_ASKED):
        if all_effects.max_force(law) != bound_N:
            seen.bound_moves = 1
    while t < lasts_s and steps < _MOST_STEPS and motion.outcome == exact.MOVING:
        before = composition.most_remaining_speed(law, motion)
        event, moved = exact.advance(law, motion, min(step_s, lasts_s - t))
        t += moved
        steps += 1
        most = all_effects.max_added_speed(law) + all_effects.max_speed_factor(law) * abs(motion.v_in)
        given = composition.most_remaining_speed(law, motion) - before
        seen.added_m_per_s = max(seen.added_m_per_s, given - most)
        if motion.contact_phase != exact.ABOVE:
            _in_head(law, motion, seen)
        fresh_N = transitions.force_now(law, motion)
        if not (abs(motion.z) < math.inf and abs(motion.v) < math.inf and abs(fresh_N) < math.inf):
            seen.not_finite = 1
            return
        if event == exact.RELEASE:
            seen.fastest_m_per_s = max(seen.fastest_m_per_s, -motion.v_in, motion.v_out)
            seen.hardest_N = max(seen.hardest_N, motion.peak_N)
            if seen.contacts < contacts.shape[0]:
                row = contacts[seen.contacts]
                row[0], row[1], row[2], row[3] = t, motion.v_in, motion.v_out, motion.peak_N
            seen.contacts += 1


@njit()
def _latched(law: Law, new_law: Law, motion: Motion, out: npt.NDArray[np.float64]) -> None:
    # Force and what pulses still give, before and after a set takes over above the head.
    out[0], out[1] = transitions.force_now(law, motion), composition.remaining_speed(law, motion)
    composition.keep_speed(law, new_law, motion)
    out[2], out[3] = transitions.force_now(new_law, motion), composition.remaining_speed(new_law, motion)


class _Run:
    """One scene's stick, thrown and played."""

    def __init__(
        self, scene: Scene, throw: float, step_s: float = _TICK_S, lasts_s: float = _LASTS_S
    ) -> None:
        self.law, self.motion = law_of(scene), thrown(scene, throw)
        self.seen: Rows[Any] = np.zeros(1, dtype_of(_Seen))
        for field in ("force_N", "stiffness", "damping_N_s_per_m", "added_m_per_s"):
            self.seen[field][:] = -math.inf
        self.contacts = np.zeros((_CONTACTS, 4))
        (name,) = scene.effects or ("",)
        with compiled_rules(name):
            _play(self.law[0], self.motion[0], lasts_s, step_s, self.seen[0], self.contacts)

    @property
    def bits(self) -> bytes:
        return self.contacts.tobytes()


def _left_well(contacts: npt.NDArray[np.float64]) -> int:
    # How many contacts from the first on the stick left faster than rounding decides.
    return int(np.cumprod(contacts[:, 2] > -_WELL * contacts[:, 1]).sum())


def _alike(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> bool:
    count = min(_left_well(one), _left_well(other))
    return np.allclose(one[:count], other[:count], rtol=_SAME, atol=_SAME)


def _drawn(chance: random.Random, quantity: Quantity) -> Any:
    if quantity.choices:
        return chance.choice(quantity.choices)
    if quantity.kind is int:
        return chance.randint(int(quantity.low), int(quantity.high))
    if chance.random() < 0.1:
        return chance.choice((quantity.low, quantity.high))
    smallest = max(quantity.low, 1e-3 * quantity.high, 1e-9) if quantity.high > 0.0 else quantity.low
    if not 0.0 < smallest < quantity.high:
        return chance.uniform(quantity.low, quantity.high)
    return min(math.exp(chance.uniform(math.log(smallest), math.log(quantity.high))), quantity.high)


def _stick(chance: random.Random) -> Stick:
    # Contacts of 1 to 20 ms, from hardly damped to overdamped; a hand that presses, lifts or is not there.
    m, contact_s = 10.0 ** chance.uniform(-3.0, -0.5), 10.0 ** chance.uniform(-3.0, -1.7)
    k_coll = min(m * (math.pi / contact_s) ** 2, 1e6)
    r_in = min(2.0 * chance.choice((0.01, 0.05, 0.1, 0.3, 1.5)) * math.sqrt(m * k_coll), 1e3)
    k_hand = chance.choice((0.0, 1e-3, 1e-2, 0.1)) * k_coll
    z_ss = chance.choice((-1.0, -1.0, 0.0, 0.1)) * 10.0 ** chance.uniform(-4.0, -1.5)
    release = chance.choice(("paper", "unilateral"))
    return Stick(m, k_coll, r_in, min(k_hand, 1e4), chance.uniform(0.0, 1.0) * r_in, z_ss, release)


def _forget_types() -> None:
    # Kept by name, and another effect of the same name has others.
    law_type.cache_clear()
    motion_type.cache_clear()


@contextmanager
def _adopted(name: str, effect: Effect | None) -> Generator[None]:
    # The effect under that name while the body runs; what was there before comes back.
    if effect is None:
        with declared(name):
            registry.find(name)
            if name not in registry.EFFECTS:
                raise ValueError(
                    "no effect of that name, neither the instrument's own nor an installed package's"
                )
        yield
        return
    before, table = registry.EFFECTS.get(name), registry.STICK_TABLES.get(name)
    with declared(name):
        registry.adopt(name, effect, effect.force.__module__)
    _forget_types()
    try:
        yield
    finally:
        _forget_types()
        del registry.EFFECTS[name], registry.STICK_TABLES[name]
        if before is not None and table is not None:
            registry.EFFECTS[name], registry.STICK_TABLES[name] = before, table


class _Search:
    """Random scenes with one effect, and the rules asked of them. The same seed draws the same scenes."""

    def __init__(self, name: str, seed: int) -> None:
        self.name, self._chance = name, random.Random(seed)
        self.table, self.part = registry.STICK_TABLES[name], registry.EFFECTS[name]

    def refuse(self, rule: str, words: str, scene: Scene | None = None) -> None:
        at = "" if scene is None else f", at {scene.effects[self.name]} with {scene.stick}"
        raise NotConforming(self.name, rule, words + at)

    def scene(self) -> Scene:
        values = {key: _drawn(self._chance, quantity) for key, quantity in quantities(self.table).items()}
        return Scene("search", stick=_stick(self._chance), effects={self.name: self.table(**values)})

    def throw(self) -> float:
        return self._chance.choice((0.05, 0.4, 2.0))

    def defaults(self) -> None:
        given = self.table()
        for key, quantity in quantities(self.table).items():
            value = getattr(given, key)
            fits = value in quantity.choices if quantity.choices else quantity.low <= value <= quantity.high
            if not fits:
                self.refuse(
                    "range", f"{key} = {value} by itself, declared {quantity.low:g} .. {quantity.high:g}"
                )

    def bad_numbers(self) -> None:
        live = {key: quantity for key, quantity in quantities(self.table).items() if quantity.wire}
        for key, quantity in live.items():
            for bad in (math.nan, math.inf, -math.inf):
                law = law_of(self.scene())
                law[self.name][field_of(key, quantity)] = bad
                wide = envelope.Limits(1e9, 1e9).record()[0]
                if envelope.judge(law[0], wide, envelope.new_scratch()).code == envelope.OK:
                    self.refuse("bad input", f"{key} = {bad} is let through to a device")

    def bounded(self, scene: Scene, throw: float) -> None:
        run = _Run(scene, throw)
        seen = run.seen[0]
        if seen["not_finite"]:
            self.refuse("finite", "its force or the stick's motion is no finite number", scene)
        if seen["bound_moves"]:
            self.refuse("deterministic", "max_force gives another bound when it is asked again", scene)
        for rule, field, unit in (
            ("force bound", "force_N", "N"),
            ("stiffness bound", "stiffness", "of K_coll"),
            ("damping bound", "damping_N_s_per_m", "N s/m"),
            ("speed bound", "added_m_per_s", "m/s"),
        ):
            if not seen[field] <= 1e-9:
                self.refuse(rule, f"adds {seen[field]:.3g} {unit} more than it declares", scene)
        if not seen["follows_N"] <= 0.0:
            self.refuse(
                "constant force",
                "its force follows z or v between events: change it in fire or renew only",
                scene,
            )
        self._within_envelope(scene, throw, run)

    def _within_envelope(self, scene: Scene, throw: float, run: _Run) -> None:
        wide = envelope.Limits(1e9, 1e9, throw)
        if envelope.judge(run.law[0], wide.record()[0], envelope.new_scratch()).code != envelope.OK:
            return
        speed, force = envelope.predicted(run.law[0], throw)
        if not run.seen[0]["fastest_m_per_s"] <= speed * _ROUNDING:
            self.refuse(
                "energy", f"{run.seen[0]['fastest_m_per_s']:.4g} m/s, the envelope says {speed:.4g}", scene
            )
        if not run.seen[0]["hardest_N"] <= force * _ROUNDING:
            self.refuse("energy", f"{run.seen[0]['hardest_N']:.4g} N, the envelope says {force:.4g}", scene)

    def repeats(self, scene: Scene, throw: float) -> None:
        once, again = _Run(scene, throw), _Run(scene, throw)
        if once.bits != again.bits or once.motion.tobytes() != again.motion.tobytes():
            self.refuse("deterministic", "the same run came out otherwise the second time", scene)

    def same_in_ticks(self, scene: Scene, throw: float) -> None:
        whole, ticks = _Run(scene, throw, math.inf).contacts, _Run(scene, throw).contacts
        if not _alike(whole, ticks):
            self.refuse("same in ticks", "cut into ticks of 1 ms, the run is another one", scene)

    def changes_without_a_jump(self, scene: Scene, throw: float) -> None:
        run = _Run(scene, throw)
        if run.motion["contact_phase"][0] != exact.ABOVE:
            return
        new, out = law_of(replace(scene, effects=self.scene().effects)), np.zeros(4)
        _latched(run.law[0], new[0], run.motion[0], out)
        if not np.allclose(out[:2], out[2:], rtol=1e-9, atol=1e-12):
            self.refuse(
                "live change", "a change above the head changes the force, or what pulses still give", scene
            )

    def identity(self, scene: Scene, throw: float) -> None:
        live = table_of(scene)[self.part.STRENGTH]
        keys = {field_of(key, quantity): key for key, quantity in quantities(self.table).items()}
        weakest = replace(scene.effects[self.name], **{keys[str(live.field)]: live.quantity.low})
        bare, played = (
            _Run(replace(scene, effects={}), throw),
            _Run(replace(scene, effects={self.name: weakest}), throw),
        )
        # One that acts by itself cuts the motion where another scene has no cut: then all but rounding.
        timed = hasattr(self.part, "due_in")
        same = _alike(bare.contacts, played.contacts) if timed else bare.bits == played.bits
        if not same:
            words = f"{live.name} = {live.quantity.low:g} does not play as a scene without it, bit for bit"
            self.refuse("zero strength", words, scene)


def check_effect(name: str, effect: Effect | None = None, *, scenes: int = 100, seed: int = 1) -> None:
    """Search for a scene in which an effect breaks a rule; NotConforming says which rule, and where.

    name: as in `[effects.NAME]`. effect: one that is not installed yet; else the instrument's own or an installed
    package's of that name. The rules: it compiles, allocates and raises nothing; numbers in range by themselves; no NaN
    let through; its force constant between events; forces and speeds within what it declares, and rolls within what the
    envelope makes of that; the same again, and in ticks; no jump by a live change; nothing at all at zero strength.

    scenes: how many random sticks, hands and values are tried. seed: the same one draws the same scenes.

    >>> from dataclasses import dataclass
    >>> import drumstick as ds
    >>> from drumstick import testing
    >>> @dataclass(frozen=True)
    ... class Sticky:
    ...     force_N: float = ds.number(0.2, 0.0, 5.0, "N", "How strongly it holds", wire="sticky.force")
    >>> boastful = ds.Effect(Sticky, force=lambda own: -own.force, max_force=lambda own: 0.5 * own.force)
    >>> testing.check_effect("sticky", boastful, scenes=5)  # it pulls twice as hard as it says
    Traceback (most recent call last):
        ...
    drumstick.testing.rules.NotConforming: sticky: force bound: adds ...
    """
    with _adopted(name, effect):
        search = _Search(name, seed)
        search.defaults()
        _Run(search.scene(), 0.4)
        search.bad_numbers()
        for _ in range(scenes):
            scene, throw = search.scene(), search.throw()
            search.bounded(scene, throw)
            search.repeats(scene, throw)
            search.same_in_ticks(scene, throw)
            search.changes_without_a_jump(scene, throw)
            if not hasattr(search.part, "sampled"):  # a head that is sampled is another one at any rate
                search.identity(scene, throw)
        some = [search.scene() for _ in range(_SOME)]
        require_no_allocation(
            name,
            lambda: [_Run(scene, 0.4, lasts_s=0.0) for scene in some],
            lambda: [_Run(scene, 0.4) for scene in some],
        )
