"""A head in air: pitch, decay and shape of a circular membrane's modes in an infinite baffle. Any thread; allocates.

The head's displacement is a sum of its modes in vacuum, u = sum q_n J_m(j_n r), one order m at a time. Each side's air
loads a wave of wavenumber x/a, with w in rad/s, c0 the speed of sound and xk = w a/c0: for x above xk with the mass
rho a/sqrt(x^2 - xk^2) per area, below with the resistance rho c0 xk/sqrt(xk^2 - x^2). A mode's Hankel transform, scaled
so that 2 int x b_n^2 dx = 1, is b_n(x) = j_n J_m(x)/(j_n^2 - x^2) (Morse and Ingard, "Theoretical acoustics", 7.4;
Christian, Davis, Tubis, Anderson, Mills and Rossing, "Effects of air loading on timpani membrane vibrations", J.
Acoust. Soc. Am. 76, 1984). With sigma the head's own mass per area, c = sqrt(tension/sigma)/a and v the weights of the
normalised modes,

    c^2 j^2 v = w^2 M(w) v,    M = 1 + mu G(w),    mu = 2 rho a/sigma,
    decay = mu w <v, H v>/(2 <v, M' v>),
    G_nk = 2 int_xk^oo x b_n b_k/sqrt(x^2 - xk^2) dx,    H_nk = 2 int_0^xk x b_n b_k/sqrt(xk^2 - x^2) dx

is solved for each mode at its own w. M' = M + (w/2) dM/dw is the effective mass: what the air holds like a spring is
in M with the other sign, and this takes it out. With a kettle, one side is a closed cylinder of depth L: for each of
its radial modes, J_m(j' r) with J_m'(j') = 0, the mass is rho coth(s L)/s where s^2 = (j'/a)^2 - (w/c0)^2, which above
the mode's cutoff is -rho cot(k L)/k with k^2 = -s^2. Its walls add a loss.

Modes with j_n up to _COUPLED are solved together, order by order. Those above are narrow in x and are solved alone,
with G = 1/sqrt(j^2 - xk^2), kettle or not: at most four cents off, least for the highest.
"""

import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.modes import Modes, bessel, modes_below
from drumstick.parameters.drum import Drum

SPEED_OF_SOUND_M_PER_S = 343.0
_COUPLED = 40.0
_REACH, _SPACING = (
    160.0,
    0.4,
)  # of the sum over x; b^2 turns every pi, so that this is exact but for what lies beyond
_ROUNDS, _CLOSE = 12, 1e-7
_APART = 1e-4  # of w, between two looks at M for its slope
_WALLS = (
    0.005  # share of a turn that the kettle's walls take: its resonances are a hundredth of their pitch wide
)

Numbers = npt.NDArray[np.float64]


class _Mix(NamedTuple):
    # Modes (targets,) as sums of columns (N,): weights (N, targets).
    columns: npt.NDArray[np.int64]
    targets: npt.NDArray[np.int64]
    weights: Numbers


class InAir(NamedTuple):
    """The modes of a head, P of them, and those (B >= P, the same ones first) that their shapes are sums of.

    c: speed of its waves without air, radii a second. f_Hz, decays (1/s, by radiation alone) and masses (over that
    without air) have shape (P,).
    """

    modes: Modes
    basis: Modes
    c: float
    f_Hz: Numbers
    decays: Numbers
    masses: Numbers
    mixes: tuple[_Mix, ...] = ()

    def mixed(self, values: Numbers) -> Numbers:
        """Values of the modes, shape (..., P), from those of the vacuum's, shape (..., B)."""
        if not self.mixes:
            return values
        found = values[..., : len(self.f_Hz)].copy()
        for mix in self.mixes:
            found[..., mix.targets] = values[..., mix.columns] @ mix.weights
        return found


def without_air(modes: Modes, f01_Hz: float) -> InAir:
    """Modes of a head in vacuum."""
    c = 2.0 * math.pi * f01_Hz / float(modes.zeros[0])
    f_Hz = f01_Hz * modes.zeros / modes.zeros[0]
    return InAir(modes, modes, c, f_Hz, np.zeros(len(f_Hz)), np.ones(len(f_Hz)))


def speed_of(drum: Drum) -> float:
    """c of the drum's head by itself, radii a second; raises as `in_air`."""
    load, w = _load_of(drum), 2.0 * math.pi * drum.f01_Hz
    return w / J01 if load is None else _speed(modes_below(_COUPLED), load, w)


def zero_at(f_Hz: float, drum: Drum) -> float:
    """j of a mode that sounds at f_Hz, beyond those that are solved together; raises as `in_air`."""
    load = _load_of(drum)
    if load is None:
        return f_Hz / drum.f01_Hz * J01
    alone = 2.0 * math.pi * f_Hz / speed_of(drum)
    zero = max(alone, J01)
    for _ in range(12):
        zero = alone * math.sqrt(
            1.0 + load.heavy / math.sqrt(zero**2 - (load.slow * 2.0 * math.pi * f_Hz) ** 2)
        )
    return max(zero, J01)


def in_air(highest: float, drum: Drum) -> InAir:
    """The modes of a scene's drum whose zero j is at most `highest`, in the air that it names.

    ValueError where no tension gives it its f01_Hz, or where the head's waves would be as fast as sound.
    """
    modes, load = modes_below(highest), _load_of(drum)
    if load is None:
        return without_air(modes, drum.f01_Hz)
    basis = modes if highest >= _COUPLED else modes_below(_COUPLED)
    c = _speed(basis, load, 2.0 * math.pi * drum.f01_Hz)
    found = _alone(modes, load, c)
    result = InAir(modes, basis, c, found.turn, found.decay, found.mass)
    mixes = tuple(
        _couple(result, load, order, 2.0 * math.pi * drum.f01_Hz)
        for order in np.unique(basis.orders[basis.zeros <= _COUPLED])
    )
    result.f_Hz[:] /= 2.0 * math.pi
    return result._replace(mixes=tuple(mix for mix in mixes if len(mix.targets)))


class _Load(NamedTuple):
    # mu; radius over the speed of sound, s; the kettle's depth in radii.
    heavy: float
    slow: float
    depth: float | None


def _load_of(drum: Drum) -> _Load | None:
    air, kettle = drum.effects.get("air"), drum.effects.get("kettle")
    if air is None or air.density_kg_per_m3 == 0.0:
        return None
    return _Load(
        heavy=2.0 * air.density_kg_per_m3 * drum.radius_m / air.head_kg_per_m2,
        slow=drum.radius_m / SPEED_OF_SOUND_M_PER_S,
        depth=None if kettle is None else kettle.depth_m / drum.radius_m,
    )


class _Found(NamedTuple):
    # w, decay and mass of modes.
    turn: Numbers
    decay: Numbers
    mass: Numbers


class _Order:
    """The air of one order's modes, `zeros`, all that are solved together."""

    def __init__(self, order: int, zeros: Numbers, load: _Load) -> None:
        self.zeros, self._order, self._load = zeros, order, load
        if load.depth is None:
            return
        count = len(zeros) + 8
        jnp_zeros, jv = bessel().jnp_zeros, bessel().jv
        self._own = jnp_zeros(order, count) if order else np.append(0.0, jnp_zeros(0, count - 1))
        size = (1.0 - (order / np.where(self._own > 0.0, self._own, 1.0)) ** 2) * jv(order, self._own) ** 2
        self._met = self._transforms(self._own) * np.sqrt(4.0 / size)

    def _transforms(self, x: Numbers) -> Numbers:
        # b_n(x), shape (N, len(x)); x meets no zero.
        return self.zeros[:, None] * bessel().jv(self._order, x) / (self.zeros[:, None] ** 2 - x**2)

    def _outside(self, xk: float) -> tuple[Numbers, Numbers]:
        # G and H. x = sqrt(xk^2 + t^2) and x = xk sin t take the roots away.
        t = (np.arange(round(_REACH / _SPACING)) + 0.5) * _SPACING
        above = self._transforms(np.sqrt(xk * xk + t * t))
        count = _points(xk)
        x = xk * np.sin((np.arange(count) + 0.5) * (0.5 * math.pi / count))
        below = self._transforms(x)
        return 2.0 * _SPACING * above @ above.T, math.pi / count * (below * x) @ below.T

    def _inside(self, xk: float, depth: float) -> tuple[Numbers, Numbers]:
        # Mass and loss of the air in the kettle, in the units of G and H: as one side of the open air has them.
        s = np.sqrt(self._own**2 - (xk * (1.0 - 1j * _WALLS)) ** 2 + 0j)
        answer = 1.0 / (s * np.tanh(s * depth))
        return (self._met * answer.real) @ self._met.T, (self._met * np.abs(answer.imag)) @ self._met.T

    def at(self, w: float) -> tuple[Numbers, Numbers]:
        """M, and mu H."""
        load, xk = self._load, w * self._load.slow
        mass, loss = self._outside(xk)
        if load.depth is not None:
            inner_mass, inner_loss = self._inside(xk, load.depth)
            mass, loss = 0.5 * (mass + inner_mass), 0.5 * (loss + inner_loss)
        return np.eye(len(self.zeros)) + load.heavy * mass, load.heavy * loss

    def slowest(self, w: float) -> tuple[float, Numbers]:
        """w and v of the lowest mode of a head that is as tight as it takes for that mode to turn at w."""
        return w, _solved(self.zeros, self.at(w)[0])[1][:, 0]

    def settled(self, c: float, w: float, place: int) -> tuple[float, Numbers]:
        """w, looked for from there on, and v of one mode at its own w: the one that has most of the vacuum's with this
        place in its order.
        """

        def look(at_w: float) -> tuple[float, Numbers]:
            values, vectors = _solved(self.zeros, self.at(at_w)[0])
            at = int(np.argmax(np.where(values > 0.0, np.abs(vectors[place]), -1.0)))
            return c / math.sqrt(float(values[at])), vectors[:, at]

        for _ in range(_ROUNDS):
            first, v = look(w)
            if abs(first - w) <= _CLOSE * w:
                return first, v
            second, v = look(first)
            # Aitken: where a row of which each step is so much of the last one ends; no farther than it has come.
            bent = second - 2.0 * first + w
            ahead = -((second - first) ** 2) / bent if bent != 0.0 else 0.0
            w = second + min(max(ahead, -abs(first - w)), abs(first - w))
        return look(w)


def _points(xk: float) -> int:
    # Of the sum over t in 0 .. pi/2, where x = xk sin t: b^2 turns every pi.
    return 16 + 2 * math.ceil(xk)


def _solved(zeros: Numbers, mass: Numbers) -> tuple[Numbers, Numbers]:
    # (w/c)^-2 of all modes, the lowest mode first, and their shapes, columns of length 1.
    from scipy import linalg

    solved: Any = cast(Any, linalg).eigh(mass, np.diag(zeros**2))
    values, vectors = cast(tuple[Numbers, Numbers], solved)
    return values[::-1], (vectors / np.linalg.norm(vectors, axis=0))[:, ::-1]


def _speed(basis: Modes, load: _Load, w: float) -> float:
    # c of the head whose lowest mode turns at w: M is known there, so its tension follows at once.
    zeros = basis.zeros[(basis.orders == 0) & (basis.zeros <= _COUPLED)]
    slowest = float(_solved(zeros, _Order(0, zeros, load).at(w)[0])[0][0])
    if not slowest > 0.0:
        raise ValueError(f"the air alone holds the head up to more than f01_Hz = {w / (2.0 * math.pi):g} Hz")
    c = w * math.sqrt(slowest)
    if not c * load.slow < 1.0:
        raise ValueError(
            f"in air, f01_Hz = {w / (2.0 * math.pi):g} Hz asks for waves on the head as fast as sound"
        )
    return c


def _alone(modes: Modes, load: _Load, c: float) -> _Found:
    # Each mode by itself.
    zeros = modes.zeros
    turn = c * zeros
    mass = np.ones(len(zeros))
    for _ in range(12):
        narrow = np.sqrt(zeros**2 - (load.slow * turn) ** 2)
        mass = 1.0 + load.heavy / narrow
        turn = c * zeros / np.sqrt(mass)
    # M' has the derivative of G besides.
    mass += 0.5 * load.heavy * (load.slow * turn) ** 2 / np.sqrt(zeros**2 - (load.slow * turn) ** 2) ** 3
    loss = np.zeros(len(zeros))
    sides = 1.0 if load.depth is None else 0.5
    for order in np.unique(modes.orders):
        own = np.flatnonzero((modes.orders == order) & (zeros > _COUPLED) & (load.slow * turn > order - 12.0))
        if len(own) == 0:
            continue
        xk = load.slow * turn[own, None]
        count = _points(float(xk.max()))
        t = (np.arange(count) + 0.5) * (0.5 * math.pi / count)
        x = xk * np.sin(t)
        b = zeros[own, None] * bessel().jv(order, x) / (zeros[own, None] ** 2 - x**2)
        loss[own] = math.pi / count * np.sum(b**2 * x, axis=1)
    return _Found(turn, 0.5 * sides * load.heavy * turn * loss / mass, mass)


def _couple(found: InAir, load: _Load, order: int, f01: float) -> _Mix:
    # Solves the modes of one order together; writes their w, decay and mass. f01: w of the lowest.
    columns = np.flatnonzero((found.basis.orders == order) & (found.basis.zeros <= _COUPLED))
    zeros = found.basis.zeros[columns]
    targets = columns[columns < len(found.f_Hz)]
    weights = np.zeros((len(columns), len(targets)))
    outside, whole = (_Order(order, zeros, each) for each in (load._replace(depth=None), load))
    for at, target in enumerate(targets):
        w, v = outside.settled(found.c, float(found.f_Hz[target]), at)
        if load.depth is not None:
            # The lowest round one is where the scene has it: a deep kettle has another beside it.
            w, v = whole.slowest(f01) if order == at == 0 else whole.settled(found.c, w, at)
        v = v * math.copysign(1.0, v[at])
        mass, loss = whole.at(w)
        beside, _ = whole.at(w * (1.0 + _APART))
        # At least the head's own: in the middle of one of the kettle's resonances the difference says less.
        moving = max(1.0, float(v @ (mass + (beside - mass) / (2.0 * _APART)) @ v))
        found.f_Hz[target], found.masses[target] = w, moving
        found.decays[target] = 0.5 * w * float(v @ loss @ v) / moving
        weights[:, at] = v * np.sqrt(found.basis.norms[target] / found.basis.norms[columns])
    return _Mix(columns, targets, weights)
