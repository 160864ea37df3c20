"""`accuracy = "auto"`: the truest mesh that fits the scene's cpu_budget on this machine. Any thread.

Each order of the scheme at each rate is a candidate. How true it is, the rms error of the first twenty modes, is known
(drumstick.drum.estimate), rounding included: the finest mesh is not the truest. Of those that are as true to the ear
the cheapest is taken. What it costs is taken from a short trial of two of its meshes, once: the result lies beside the
compiled kernels, so that the same scene gets the same mesh, and the same samples, until kernels or processor change.
"""

import dataclasses
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
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from realtime.kernels.cache_files import read_beside, write_beside

_MAX_DIVISOR = 12
_NAMES = {2: "standard", 4: "fine"}  # what a scene calls the order of the scheme
_FRAMES, _WINDOWS, _BLOCK = 1200, 9, 128
_BLOW_N, _BLOW_S, _BLOW_M_PER_S = 5.0, 0.005, 1.0
_AS_TRUE_CENTS = 0.05  # a hundredth of what the best ear tells from another pitch
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
    scene: Scene
    updates: float  # junctions computed in one sample of the device
    cents: float


def fitted(scene: Scene, rate_Hz: int, again: bool = False, measured_on: Scene | None = None) -> Fit:
    """The scene with its mesh chosen. The first time it compiles, and tries for a second; `again` tries anew.

    `measured_on`: the scene whose meshes tell what a junction costs, of the same effects; the scene itself without.
    Raises Unplayable."""
    if scene.mesh.accuracy != "auto":
        return Fit(scene)
    found = _candidates(scene, rate_Hz)
    measured = scene if measured_on is None else measured_on
    models = _cost_models(
        measured, rate_Hz, found if measured is scene else _candidates(measured, rate_Hz), again
    )
    shares = [1e-9 * rate_Hz * _ns(models[each.order], each.updates) for each in found]
    fitting = [k for k, share in enumerate(shares) if share <= scene.mesh.cpu_budget]
    others = [k for k in range(len(found)) if k not in fitting]
    wished = sorted(fitting, key=lambda k: found[k].cents) + sorted(others, key=lambda k: shares[k])
    # Where none can be, the first: `build` then says why.
    at = next((k for k in wished if _can_be(found[k], rate_Hz)), wished[0])
    if at in fitting:
        as_true = [k for k in fitting if found[k].cents <= found[at].cents + _AS_TRUE_CENTS]
        by_cost = sorted(as_true, key=lambda k: shares[k])
        at = next(k for k in by_cost if k == at or _can_be(found[k], rate_Hz))
    return Fit(found[at].scene, _words(scene, found[at], shares[at], at in fitting))


def _words(scene: Scene, chosen: _Candidate, share: float, fits: bool) -> str:
    order = "fourth" if chosen.order == max(_NAMES) else "second"
    budget = f"{100.0 * scene.mesh.cpu_budget:.0f} %"
    what = f"auto: {order} order, {chosen.cents:.1f} cents, {100.0 * share:.2g} % of a core as measured here"
    return (
        f"{what}; it may take {budget}"
        if fits
        else f"{what}, the cheapest there is, and over its budget of {budget}"
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
                (order, real), _Candidate(order, tried, stored.updates_per_s / rate_Hz, stored.cents)
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
