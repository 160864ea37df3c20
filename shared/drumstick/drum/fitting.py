"""`accuracy = "auto"`: the cheapest mesh on this machine that is as true as the scene's auto_jnd asks. Any thread.

Each order of the scheme at each rate is a candidate. How true it is, the rms error of the first twenty modes, is known
(drumstick.drum.estimate), rounding included: the finest mesh is not the truest. It is told in just noticeable
differences of pitch (drumstick.perception.jnd). A slow mesh may be in tune and still dull, for what lies above half of
its rate is missing: none is taken that is slower than `standard`'s. Where none of these fits cpu_budget, the fastest
that is in tune is taken, or else the truest. What it costs is taken from a short trial of two of its meshes, once: the
result lies beside the compiled kernels, so that the same scene gets the same mesh, and the same samples, until kernels
or processor change.
"""

import dataclasses
import functools
import json
import math
import statistics
import time
from typing import NamedTuple

import numpy as np
from llvmlite import binding

from drumstick.drum import estimate, tiers
from drumstick.drum.block import render_all
from drumstick.drum.build import Unplayable, new_engine
from drumstick.drum.membrane.pitch_error import TWENTIETH
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from drumstick.perception.jnd import pitch_jnd_cents, sharpest_Hz
from realtime.kernels.cache_files import read_beside, write_beside

_MAX_DIVISOR = 12
_NAMES = {2: "standard", 4: "fine"}  # what a scene calls the order of the scheme
_FRAMES, _WINDOWS, _BLOCK = 1200, 9, 128
_BLOW_N, _BLOW_S, _BLOW_M_PER_S = 5.0, 0.005, 1.0
_FILE = "speeds.json"
_MAX_BYTES = 10_000_000


class CostModel(NamedTuple):
    """CPU ns a sample of the device: `fixed_ns`, and `update_ns` for each junction computed in it."""

    fixed_ns: float
    update_ns: float


class Fit(NamedTuple):
    """The scene with its mesh accuracy fixed. `note`: how `auto` chose it; else empty."""

    scene: Scene
    note: str = ""


class _Candidate(NamedTuple):
    order: int
    divisor: int  # samples of the device in one step of the mesh
    scene: Scene
    updates: float  # junctions computed in one sample of the device
    cents: float


def fitted(scene: Scene, rate_Hz: int, again: bool = False, measured_on: Scene | None = None) -> Fit:
    """The scene with its mesh chosen. The first time it compiles, and tries for a second; `again` tries anew.

    `measured_on`: the scene whose meshes tell what a junction costs, of the same effects; the scene itself without.
    Raises Unplayable."""
    if scene.mesh.accuracy != "auto":
        return Fit(scene)
    try:
        found = _candidates(scene, rate_Hz)
    except (ValueError, ArithmeticError) as error:  # air or bending leave no such head
        raise Unplayable(f"the drum of {scene.name} cannot be computed at {rate_Hz} Hz ({error})") from error
    measured = scene if measured_on is None else measured_on
    models = _cost_models(
        measured, rate_Hz, found if measured is scene else _candidates(measured, rate_Hz), again
    )
    shares = [1e-9 * rate_Hz * _ns(models[each.order], each.updates) for each in found]
    jnd_cents, slowest = _jnd_cents(scene), _slowest(scene, rate_Hz)
    most_cents = scene.mesh.auto_jnd * jnd_cents

    @functools.cache
    def can_be(k: int) -> bool:
        return _can_be(found[k], rate_Hz)

    def best(most_cents: float) -> int:
        def wish(k: int) -> tuple[float, ...]:
            in_tune, divisor = found[k].cents <= most_cents, found[k].divisor
            if shares[k] > scene.mesh.cpu_budget:
                return (3, shares[k])
            if not in_tune:
                return (2, found[k].cents)
            return (0, shares[k]) if divisor <= slowest else (1, divisor, shares[k])

        wished = sorted(range(len(found)), key=wish)
        # Where none can be, the first: `build` then says why.
        return next((k for k in wished if can_be(k)), wished[0])

    at = best(most_cents)
    saved = shares[at] - shares[best(most_cents + jnd_cents)]
    truer = [
        share / shares[at]
        for each, share in zip(found, shares, strict=True)
        if each.cents <= 0.5 * found[at].cents and each.divisor <= max(slowest, found[at].divisor)
    ]
    would_do = any(
        each.cents <= most_cents and shares[k] < shares[at] and can_be(k) for k, each in enumerate(found)
    )
    why = _why(scene, found[at], shares[at], slowest, would_do)
    return Fit(
        found[at].scene, f"{_what(scene, found[at], shares[at])}; {why}; {_more(truer)}; {_less(saved)}"
    )


def _heard_Hz(scene: Scene) -> float:  # noqa: N802
    # Of the first twenty modes the place where the ear is sharpest.
    return sharpest_Hz(scene.drum.f01_Hz, TWENTIETH * scene.drum.f01_Hz)


def _jnd_cents(scene: Scene) -> float:
    return pitch_jnd_cents(_heard_Hz(scene))


def _slowest(scene: Scene, rate_Hz: int) -> int:
    # Samples a step of `standard`, whatever it costs.
    mesh = dataclasses.replace(scene.mesh, accuracy="standard", cpu_budget=math.inf)
    return tiers.divisor_for(dataclasses.replace(scene, mesh=mesh), rate_Hz)


def _what(scene: Scene, chosen: _Candidate, share: float) -> str:
    order = "fourth" if chosen.order == max(_NAMES) else "second"
    off = chosen.cents / _jnd_cents(scene)
    return (
        f"auto: {order} order, {chosen.cents:.1f} cents or {off:.2g} JND of pitch at {_heard_Hz(scene):.0f} Hz, "
        f"{100.0 * share:.2g} % of a core as measured here"
    )


def _why(scene: Scene, chosen: _Candidate, share: float, slowest: int, would_do: bool) -> str:
    # What binds. would_do: a cheaper mesh is in tune.
    mesh = scene.mesh
    budget = f"its budget of {100.0 * mesh.cpu_budget:.0f} %"
    missed = chosen.cents / _jnd_cents(scene) - mesh.auto_jnd
    if share > mesh.cpu_budget:
        return f"the cheapest there is, and over {budget}"
    if missed > 0.0:
        return f"the truest within {budget}, and {missed:.2g} JND more than it may be off"
    if chosen.divisor > slowest:
        return f"the brightest within {budget}, and duller than standard"
    if would_do:
        return "brightness binds: a slower mesh is in tune, and duller than standard"
    return f"pitch binds: the first twenty modes may be off by {mesh.auto_jnd:g} JND"


def _more(times: list[float]) -> str:
    if not times:
        return "no mesh has half of that error"
    return f"half of that error costs {min(times):.2g} times the time"


def _less(saved: float) -> str:
    return (
        f"one JND more would save {100.0 * saved:.2g} % of a core"
        if saved > 0.0
        else "one JND more would save nothing"
    )


def _candidates(scene: Scene, rate_Hz: int) -> list[_Candidate]:
    # Every order and rate, once each: rates that would leave too few junctions across come out as higher ones.
    found: dict[tuple[int, int], _Candidate] = {}
    for divisor in range(1, _MAX_DIVISOR + 1):
        for name in _NAMES.values() if tiers.takes_fourth(scene.mesh) else ("standard",):
            mesh = dataclasses.replace(
                scene.mesh,
                accuracy=name,
                rate_Hz=rate_Hz / divisor,
                junctions_across=0.0,
                cpu_budget=math.inf,
            )
            tried = dataclasses.replace(scene, mesh=mesh)
            real = tiers.divisor_for(tried, rate_Hz)
            order = tiers.order_of(tried, rate_Hz / real)
            stored = estimate.of(name, tried, rate_Hz)
            found.setdefault(
                (order, real), _Candidate(order, real, tried, stored.updates_per_s / rate_Hz, stored.cents)
            )
    return list(found.values())


def _ns(model: CostModel, updates: float) -> float:
    return model.fixed_ns + model.update_ns * updates


def _cost_models(scene: Scene, rate_Hz: int, found: list[_Candidate], again: bool) -> dict[int, CostModel]:
    # By order: kept, or measured and kept.
    kept = {} if again else _read()
    models: dict[int, CostModel] = {}
    new = False
    for order in sorted({each.order for each in found}):
        key = _key(scene, rate_Hz, order)
        model = kept.get(key)
        if model is None:
            model, new = _measured([each for each in found if each.order == order], rate_Hz), True
        models[order] = model
    if new:
        _write(_read() | {_key(scene, rate_Hz, order): model for order, model in models.items()})
    return models


def _measured(found: list[_Candidate], rate_Hz: int) -> CostModel:
    # Of two meshes, by turns: the coarsest that is not too coarse to tell, and one of about four times the work.
    usual = [
        each for each in found if tiers.across_of(each.scene, each.scene.mesh.rate_Hz) >= tiers.MIN_ACROSS
    ]
    by_size = sorted(usual or found, key=lambda each: each.updates)
    small = next((each for each in by_size if _can_be(each, rate_Hz)), by_size[-1])
    by_ratio = sorted(found, key=lambda each: abs(math.log(each.updates / (4.0 * small.updates))))
    large = next((each for each in by_ratio if _can_be(each, rate_Hz)), small)
    trials = [_Trial(each, rate_Hz) for each in (small, large)]
    runs = [[trial.ns_per_sample() for trial in trials] for _ in range(_WINDOWS)]
    # The median, not the least: a budget is for what a block takes as a rule.
    few, many = (statistics.median(column) for column in zip(*runs, strict=True))
    slope = (many - few) / (large.updates - small.updates) if large.updates > small.updates else 0.0
    update_ns = slope if 0.0 < slope * small.updates <= few else few / small.updates
    return CostModel(few - update_ns * small.updates, update_ns)


def _can_be(tried: _Candidate, rate_Hz: int) -> bool:
    # Strong effects leave a wave no room on a coarse mesh.
    try:
        new_engine(tried.scene, rate_Hz, StrikeRing())
    except Unplayable:
        return False
    return True


class _Trial:
    def __init__(self, tried: _Candidate, rate_Hz: int) -> None:
        self._ring = StrikeRing()
        self._engine = new_engine(tried.scene, rate_Hz, self._ring)
        self._out = np.zeros((_FRAMES, 2), np.float32)
        self.ns_per_sample()

    def ns_per_sample(self) -> float:
        self._ring.push(0, 0.5, 0.0, _BLOW_N, _BLOW_S, speed_m_per_s=_BLOW_M_PER_S)  # it rings
        begun = time.thread_time_ns()
        render_all(self._engine, self._out, _BLOCK, 0)
        return (time.thread_time_ns() - begun) / _FRAMES


def _key(scene: Scene, rate_Hz: int, order: int) -> str:
    drum, listen = scene.drum, scene.listen
    parts = [
        binding.get_host_cpu_name(),
        rate_Hz,
        order,
        scene.mesh.topology,
        scene.mesh.courant,
        f"{drum.f01_Hz:g} Hz",
        drum.excitation,
        scene.mallet or "",
        # With their numbers: a tighter head has fewer junctions, deeper air another second head.
        *sorted(f"{name} {table}" for name, table in drum.effects.items()),
        listen.pickups,
        listen.microphones,
    ]
    return " ".join(map(str, parts))


def _read() -> dict[str, CostModel]:
    try:
        stored = json.loads(read_beside(__name__, _FILE, _MAX_BYTES))
        models = {str(key): CostModel(float(fixed), float(update)) for key, (fixed, update) in stored.items()}
        return {
            key: model
            for key, model in models.items()
            if all(map(math.isfinite, model)) and model.update_ns > 0.0
        }
    except (OSError, ValueError, TypeError, AttributeError, RecursionError, OverflowError):
        return {}  # not there, or not ours: it is measured


def _write(models: dict[str, CostModel]) -> None:
    write_beside(__name__, _FILE, json.dumps(models, indent=1))
