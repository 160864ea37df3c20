"""Membranes for tests: what a step should do, and what a drum holds, in float64 and by itself.

The energy here shares nothing with the kernels but the heights and the lattice's weights: it is the judge of theirs.
"""

import functools
import math
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq
from scipy.special import jv

from drumstick.drum.effects.air import Air
from drumstick.drum.effects.cavity import Cavity
from drumstick.drum.effects.snare import Snare
from drumstick.drum.effects.tension import Tension
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.sweep import Head
from realtime.records import is_there

Doubles = npt.NDArray[np.float64]


def is_triangular(head: Head) -> bool:
    """By its grid."""
    return "shifted" in (head.grid.dtype.names or ())


@functools.cache
def _neighbours(size: int, stride: int, centre_row: int, triangular: bool) -> npt.NDArray[np.int64]:
    # Shape (4 or 6, size): each junction's neighbours. The rows of a triangular mesh are shifted by turns.
    places = np.arange(size).reshape(-1, stride)
    found = [np.roll(places, shift, axis) for axis in (0, 1) for shift in (1, -1)]
    if triangular:
        near = np.where((np.arange(len(places)) - centre_row) % 2 == 1, 1, -1)[:, None]
        column = (np.arange(stride) + near) % stride
        found += [np.take_along_axis(beside, column, 1) for beside in found[:2]]
    return np.array(found).reshape(-1, size)


def neighbour_sum(head: Head, u: npt.NDArray[Any]) -> Doubles:
    """The sum over each junction's neighbours."""
    grid = head.grid[0]
    around = _neighbours(u.size, int(grid["stride"]), int(grid["centre_row"]), is_triangular(head))
    return u.ravel().astype(np.float64)[around].sum(axis=0)


class Membrane:
    """One head, its weights without what is baked into them, and its junctions' masses."""

    def __init__(self, head: Head, weight_scale: float) -> None:
        neighbours = 6 if is_triangular(head) else 4
        self.head = head
        self.weights = head.weights.astype(np.float64) / weight_scale
        inside = self.weights > 0.0
        self.mass = np.zeros_like(self.weights)
        self.mass[inside] = 1.0 / (neighbours * self.weights[inside])

    def laplacian(self, u: npt.NDArray[Any]) -> Doubles:
        """A u."""
        return np.where(self.weights > 0.0, self.weights * neighbour_sum(self.head, u) - u, 0.0)

    def product(self, u: npt.NDArray[Any], v: npt.NDArray[Any]) -> float:
        """<u, L v>, the stretch between two time levels."""
        return -float(np.sum(self.mass * u.astype(np.float64) * self.laplacian(v)))

    def energy(
        self, u: npt.NDArray[Any], before: npt.NDArray[Any], tau: float, order_4: float = 0.0
    ) -> float:
        """Energy of a head without losses: kinetic, and the stretch between the two time levels."""
        moved = u.astype(np.float64) - before
        return 0.5 * float(np.sum(self.mass * moved * moved)) + 0.5 * self.pull(u, before, tau, order_4)

    def pull(self, u: npt.NDArray[Any], v: npt.NDArray[Any], tau: float, order_4: float) -> float:
        """-<u, K v>, where K = tau A + order_4 A A is what a step adds."""
        found = tau * self.product(u, v)
        if order_4:
            found -= order_4 * float(np.sum(self.mass * self.laplacian(u) * self.laplacian(v)))
        return found

    def energy_with_momentum(
        self,
        u: npt.NDArray[Any],
        before: npt.NDArray[Any],
        scheme: tuple[float, float],
        rho: float,
        eta: float,
    ) -> float:
        """Quadratic form that never grows where high modes lose more; without losses it is `energy`.

        scheme: tau and order_4. With b = 1 + rho - (1 + eta) q and r = rho (1 - eta q) a step is u+ = b u - r u-. By
        it the form <u+, (1 + r) u+> + <u, (1 + r) u> - 2 <u+, b u> loses <d, (1 - r) d>, where d = u+ - u-.
        """
        v, w = u.astype(np.float64), before.astype(np.float64)
        sizes = float(np.sum(self.mass * (v - w) ** 2))
        own = self.pull(v, v, *scheme) + self.pull(w, w, *scheme)
        return 0.25 * ((1.0 + rho) * sizes + 2.0 * (1.0 + eta) * self.pull(v, w, *scheme) - rho * eta * own)


def of_tension(tension: Tension, stretch: float) -> float:
    """Energy of a tension's rise, at a stretch: V of drumstick.drum.effects.tension."""
    state = tension.state[0]
    most, kappa, size = float(state["q_most"]), float(state["kappa"]), abs(stretch)
    followed = size if kappa * size <= most else most / kappa
    return 0.25 * kappa * followed**2 + 0.5 * most * (size - followed)


def _of_snare(snare: Snare, head: Head, level: int) -> float:
    # Of the strings' movement and stretch, and what pushing the head has stored beyond the push at rest.
    state, now, before = snare.state[0], snare.places[level], snare.places[1 - level]
    stiffness, tight = float(state["stiffness"]), float(state["tight"])
    if tight <= -1.0:  # off: the head does not meet them
        return 0.0
    eta_0 = tight * float(state["eta_0"] if tight > 0.0 else state["gap"])
    moved = now - before
    stretch = (
        float(state["spring"])
        * max(tight, 0.1)
        * float(np.sum(np.diff(now, axis=1) * np.diff(before, axis=1)))
    )
    found = 0.5 * float(state["mass"]) * (float(np.sum(moved * moved)) + stretch)
    at_rest = max(eta_0, 0.0)
    under = snare.first[:, None] + int(state["apart"]) * np.arange(now.shape[1] - 2)
    for at in (level, 1 - level):
        eta = head.time_levels[at].astype(float)[under] - snare.places[at][:, 1:-1]
        pressed = np.maximum(eta + eta_0, 0.0)
        found += 0.5 * float(np.sum(0.5 * stiffness * (pressed**2 - at_rest**2) - stiffness * at_rest * eta))
    return found


def _of_air(air: Air, u: npt.NDArray[Any], before: npt.NDArray[Any]) -> float:
    # By how much softer the head is, and what a loss that lags by half a step has taken already.
    dual = air.moved.dual.astype(float)
    now, then = (dual @ heights[air.moved.places].astype(float) for heights in (u, before))
    lost = float(np.sum(air.moved.loss.astype(float) * (now - then) ** 2))
    return -0.5 * float(now @ air.moved.stiffness.astype(float) @ then) - 0.25 * lost


def second_head(cavity: Cavity) -> tuple[Membrane, float, float, float, float]:
    """The membrane of a drum's second head, its tau and order_4, 1 + s, and what its weights are multiplied with."""
    state = cavity.state[0]
    loss_divisor = 2.0 / (1.0 + float(state["u_old_gain"]))
    second_4 = float(state["order_4"]) * loss_divisor
    tau = 2.0 - float(state["u_gain"]) * loss_divisor
    if second_4:
        tau = second_4 + float(state["order_2"]) * loss_divisor
    baked = 1.0 if second_4 else tau / loss_divisor
    return Membrane(cavity.head, baked), tau, second_4, loss_divisor, baked


def energy(engine: Engine) -> float:
    """All that is in the drum now, in units of the first head's junctions."""
    control = engine.control[0]
    at = int(control["present_level"])
    membrane = Membrane(engine.head, float(control["own_gain"]))
    u, before = engine.head.time_levels[at], engine.head.time_levels[1 - at]
    tau, order_4 = float(control["tau"]), float(control["order_4"]) * float(control["loss_divisor"])
    if not is_there(engine.effects.internal_loss):
        found = membrane.energy(u, before, tau, order_4)
    else:
        rho, eta = (float(gain) for gain in engine.effects.internal_loss.gains)
        found = membrane.energy_with_momentum(u, before, (tau, order_4), rho, eta)
    if is_there(engine.effects.air):
        found += float(control["loss_divisor"]) * _of_air(engine.effects.air, u, before)
    if is_there(engine.effects.tension):
        found += of_tension(engine.effects.tension, membrane.product(u, before))
    if is_there(engine.effects.cavity):
        state, head = engine.effects.cavity.state[0], engine.effects.cavity.head
        second, tau, second_4, loss_divisor, baked = second_head(engine.effects.cavity)
        area, second_area = 1.0 / float(state["per_area_1"]), 1.0 / float(state["per_area_2"])
        spring = float(state["push_2"]) * baked * loss_divisor / (6 if is_triangular(head) else 4)

        def apart(level: int) -> float:
            first = float(np.sum(engine.head.time_levels[level], dtype=np.float64)) / area
            return first - float(np.sum(head.time_levels[level], dtype=np.float64)) / second_area

        in_second = second.energy(head.time_levels[at], head.time_levels[1 - at], tau, second_4)
        if is_there(engine.effects.snare):
            in_second += _of_snare(engine.effects.snare, head, at)
        found += area / second_area * in_second
        found += 0.5 * area * spring * apart(at) * apart(1 - at)
    return found


def coupled_modes(f01_Hz: tuple[float, float], spring_per_s2: float, below_Hz: float) -> list[float]:
    """Modes of two ideal heads with a spring between their mean displacements, that the spring moves.

    In each head u = (K D/w^2)(1 - J0(w r/c)/J0(w/c)), D being the difference of the means, so w^2 = K (g_1 + g_2)
    with g = 1 - 2 J1(k)/(k J0(k)) at k = w/c.
    """

    def open_part(w: float) -> float:
        found = w * w
        for f_Hz in f01_Hz:
            k = w * J01 / (2.0 * math.pi * f_Hz)
            found -= spring_per_s2 * (1.0 - 2.0 * float(jv(1, k)) / (k * float(jv(0, k))))
        return found

    way = 2.0 * math.pi * np.linspace(0.317 * min(f01_Hz), below_Hz, 4000)  # off the poles
    signs = [open_part(float(w)) for w in way]
    roots = [
        float(brentq(open_part, low, high, xtol=1e-9))
        for low, high, a, b in zip(way, way[1:], signs, signs[1:], strict=False)
        if a * b < 0.0
    ]
    return [w / (2.0 * math.pi) for w in roots if abs(open_part(w)) < 1e-3 * spring_per_s2]  # else a pole
