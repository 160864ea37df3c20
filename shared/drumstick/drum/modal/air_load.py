"""A head in air: pitch, decay and shape of a circular membrane's modes. Any thread; allocates.

The head's displacement is a sum of its modes in vacuum, u = sum q_n J_m(j_n r), one order m at a time. Each side's air
loads a wave of wavenumber x/a, with w in rad/s, c0 the speed of sound and xk = w a/c0: for x above xk with the mass
rho a/sqrt(x^2 - xk^2) per area, below with the resistance rho c0 xk/sqrt(xk^2 - x^2). A mode's Hankel transform, scaled
so that 2 int x b_n^2 dx = 1, is b_n(x) = j_n J_m(x)/(j_n^2 - x^2) (Morse and Ingard, "Theoretical acoustics", 7.4;
Christian, Davis, Tubis, Anderson, Mills and Rossing, "Effects of air loading on timpani membrane vibrations", J.
Acoust. Soc. Am. 76, 1984). With sigma the head's own mass per area, c = sqrt(tension/sigma)/a and v the weights of the
normalised modes, s = D/(sigma a^4) with D the bending stiffness (Morse and Ingard, 5.3; a rim that lets it turn),

    (c^2 j^2 + s j^4) v = w^2 M(w) v,    M = 1 + mu G(w),    mu = 2 rho a/sigma,
    decay = mu w <v, H v>/(2 <v, M' v>),
    G_nk = 2 int_xk^oo x b_n b_k/sqrt(x^2 - xk^2) dx,    H_nk = 2 int_0^xk x b_n b_k/sqrt(xk^2 - x^2) dx

is solved for each mode at its own w. M' = M + (w/2) dM/dw is the effective mass: what the air holds like a spring is
in M with the other sign, and this takes it out.

With a kettle, one side is a closed cylinder of depth L with rigid walls: its own modes, J_m(j' r) cos(l pi z/L) with
J_m'(j') = 0, are masses on springs beside the head's, the higher ones together a mass. So each mode of the two has its
place among them, and none is taken twice. The walls take a part of what the cylinder's modes hold.

That holds in an infinite baffle. Without one the two sides' sound meets round the rim: of what a mode radiates xk^2/(1
+ xk^2) is left, as of a dipole beside a monopole where waves are long, and all where they are short; its mass is left
as it is. Where it bends, at xk = 1, is an estimate: the lowest mode of a tom then rings about as long as recorded ones
do.

Modes with j_n up to _COUPLED are solved together, order by order. Those above are narrow in x and are solved alone,
with G = 1/sqrt(j^2 - xk^2), kettle or not: at most four cents off, least for the highest.
"""

import functools
import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.modes import Modes, bessel, bessel_between, modes_below
from drumstick.parameters.drum import Drum

_COUPLED = 40.0
# Of the sum over x; b^2 turns every pi, so that this is exact but for what lies beyond.
_REACH, _SPACING = 160.0, 0.4
_ROUNDS, _CLOSE = 20, 1e-7
_BELOW_SOUND, _CLOSE_ALONE = 0.999, 1e-4  # of sound's speed; of w, between the last two rounds
_APART = 1e-4  # of w, between two looks at M for its slope
_WALLS = 0.005  # the kettle's resonances have a Q of 100
_KETTLE, _MAX_OF_KETTLE = 30.0, 48  # wavenumber of its modes, and most of them with each order

Numbers = npt.NDArray[np.float64]


class _Mix(NamedTuple):
    # Modes (targets,) as sums of columns (N,): weights (N, targets).
    columns: npt.NDArray[np.int64]
    targets: npt.NDArray[np.int64]
    weights: Numbers


class InAir(NamedTuple):
    """The modes of a head, P of them, and those (B >= P, the same ones first) that their shapes are sums of.

    c: speed of its waves without air, radii a second. f_Hz, decays (1/s, by radiation alone), masses (over that without
    air) and radiated (the share of the power in an infinite baffle) have shape (P,).
    """

    modes: Modes
    basis: Modes
    c: float
    f_Hz: Numbers
    decays: Numbers
    masses: Numbers
    radiated: Numbers
    mixes: tuple[_Mix, ...] = ()

    def of_tension(self) -> Numbers:
        """Share of each w^2 that is the tension's, shape (P,): kettle's air and bending are springs beside it."""
        own: Numbers = self.modes.zeros**2
        for mix in self.mixes:
            sizes = mix.weights**2 * self.basis.norms[mix.columns, None] / self.modes.norms[mix.targets]
            own[mix.targets] = self.basis.zeros[mix.columns] ** 2 @ sizes
        return self.c**2 * own / ((2.0 * math.pi * self.f_Hz) ** 2 * self.masses)

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
    return InAir(modes, modes, c, f_Hz, np.zeros(len(f_Hz)), np.ones(len(f_Hz)), np.ones(len(f_Hz)))


def speed_of(drum: Drum) -> float:
    """c of the drum's head by itself, radii a second; raises as `in_air`."""
    load, w = load_of(drum), 2.0 * math.pi * drum.f01_Hz
    return w / J01 if load is None else _speed(load, w)


def zero_at(f_Hz: float, drum: Drum) -> float:
    """j of a mode that sounds at f_Hz, beyond those that are solved together; raises as `in_air`."""
    load = load_of(drum)
    if load is None:
        return f_Hz / drum.f01_Hz * J01
    w, c = 2.0 * math.pi * f_Hz, speed_of(drum)
    mass, zero = 1.0, J01
    for _ in range(13):
        # c^2 j^2 + s j^4 = w^2 M, in the form that holds without bending too.
        of_tension = 0.5 * c**2
        whole = of_tension + math.sqrt(of_tension**2 + load.bending_per_s2 * w**2 * mass)
        zero = max(w * math.sqrt(mass / whole), J01)
        slow = zero**2 - (load.radius_over_sound_speed_s * w) ** 2
        if not slow > 0.0:
            raise ValueError(f"at {f_Hz:g} Hz waves are as fast as sound: lower bending_N_m")
        mass = 1.0 + load.mass_ratio / math.sqrt(slow)
    return zero


def in_air(highest: float, drum: Drum) -> InAir:
    """The modes of a scene's drum whose zero j is at most `highest`, in the air that it names. Kept, read only.

    ValueError where no tension gives it its f01_Hz, or where the head's waves would be as fast as sound.
    """
    return under_load(highest, drum.f01_Hz, load_of(drum))


@functools.lru_cache(maxsize=8)
def under_load(highest: float, f01_Hz: float, load: "Load | None") -> InAir:
    """Modes of `in_air`, by what they depend on alone."""
    modes = modes_below(highest)
    if load is None:
        return without_air(modes, f01_Hz)
    basis = modes if highest >= _COUPLED else modes_below(_COUPLED)
    w01 = 2.0 * math.pi * f01_Hz
    c = _speed(load, w01)
    found = _alone(modes, load, c)
    result = InAir(modes, basis, c, found.omega, found.decay, found.mass, np.ones(len(modes.zeros)))
    mixes = tuple(
        _couple(result, load, order, w01) for order in np.unique(basis.orders[basis.zeros <= _COUPLED])
    )
    result.f_Hz[:] /= 2.0 * math.pi
    if not load.baffled:
        xk = 2.0 * math.pi * result.f_Hz * load.radius_over_sound_speed_s
        result.radiated[:] = xk**2 / (1.0 + xk**2)
        result.decays[:] *= result.radiated
    for values in (result.f_Hz, result.decays, result.masses, result.radiated):
        values.setflags(write=False)
    return result._replace(mixes=tuple(mix for mix in mixes if len(mix.targets)))


class Load(NamedTuple):
    """mass_ratio is mu; whether it sits in a baffle; bending_per_s2 is s."""

    mass_ratio: float
    radius_over_sound_speed_s: float
    kettle_depth_radii: float | None
    baffled: bool
    bending_per_s2: float


def is_in_air(drum: Drum) -> bool:
    """True when the drum's modes are those in air."""
    return "air" in drum.effects


def load_of(drum: Drum) -> Load | None:
    """Air that a drum has on its head."""
    air, kettle = drum.effects.get("air"), drum.effects.get("kettle")
    if air is None or air.density_kg_per_m3 == air.bending_N_m == 0.0:
        return None
    return Load(
        mass_ratio=2.0 * air.density_kg_per_m3 * drum.radius_m / air.head_kg_per_m2,
        radius_over_sound_speed_s=drum.radius_m / SOUND_M_PER_S,
        kettle_depth_radii=None if kettle is None else kettle.depth_m / drum.radius_m,
        baffled=air.baffle == "endless",
        bending_per_s2=air.bending_N_m / (air.head_kg_per_m2 * drum.radius_m**4),
    )


def _stiffness(zeros: Numbers, load: Load, c: float) -> Numbers:
    # w^2 of modes in vacuum.
    return (c * zeros) ** 2 + load.bending_per_s2 * zeros**4


class _Found(NamedTuple):
    # omega is w; decay and mass of modes.
    omega: Numbers
    decay: Numbers
    mass: Numbers


class _Order:
    """The air of one order's modes, `zeros`, all that are solved together, on a head with waves of speed c."""

    def __init__(self, order: int, load: Load, c: float) -> None:
        all_of_them = modes_below(_COUPLED)
        self.zeros = all_of_them.zeros[all_of_them.orders == order]
        self._order, self._load = order, load
        count = len(self.zeros)
        self._stiff, self._drawn = np.diag(_stiffness(self.zeros, load, c)), np.zeros((count, 0))
        self._held, self._own = np.zeros((count, count)), np.zeros(0)
        if load.kettle_depth_radii is not None:
            self._add_kettle(load.kettle_depth_radii)

    def _add_kettle(self, depth: float) -> None:
        # Cylinder modes up to a wavenumber, and as a mass what is above; the one of k = 0 is a spring alone.
        mass_ratio, order = 0.5 * self._load.mass_ratio, self._order
        count = len(self.zeros) + 8
        jnp_zeros, jv = bessel().jnp_zeros, bessel().jv
        own = jnp_zeros(order, count) if order else np.append(0.0, jnp_zeros(0, count - 1))
        size = (1.0 - (order / np.where(own > 0.0, own, 1.0)) ** 2) * jv(order, own) ** 2
        met = self._transforms(own) * np.sqrt(4.0 * mass_ratio / size)
        safe = np.where(own > 0.0, own, 1.0)
        still = np.where(own > 0.0, 1.0 / (safe * np.tanh(safe * depth)), depth / 3.0)
        self._held = (met * still) @ met.T
        if order == 0:
            self._stiff = self._stiff + np.outer(met[:, 0], met[:, 0]) / (
                depth * self._load.radius_over_sound_speed_s**2
            )
        along = np.arange(math.ceil(_KETTLE * depth / math.pi) + 1)
        k = np.sqrt(own[:, None] ** 2 + (along * math.pi / depth) ** 2)
        q, at = np.nonzero((k > 0.0) & (k < _KETTLE))
        chosen = np.argsort(k[q, at])[:_MAX_OF_KETTLE]
        q, at = q[chosen], at[chosen]
        self._own = k[q, at]
        self._drawn = met[:, q] * np.sqrt(np.where(at > 0, 2.0, 1.0) / depth) / self._own

    def _transforms(self, x: Numbers) -> Numbers:
        # b_n(x), shape (N, len(x)); x meets no zero.
        return self.zeros[:, None] * bessel_between(self._order, x) / (self.zeros[:, None] ** 2 - x**2)

    def _outside(self, w: float) -> tuple[Numbers, Numbers]:
        # mu G and mu H, or half of both over a kettle. x = sqrt(xk^2 + t^2) and x = xk sin t take the roots away.
        xk, share = (
            w * self._load.radius_over_sound_speed_s,
            self._load.mass_ratio * (1.0 if self._load.kettle_depth_radii is None else 0.5),
        )
        t = (np.arange(round(_REACH / _SPACING)) + 0.5) * _SPACING
        above = self._transforms(np.sqrt(xk * xk + t * t))
        count = _points(xk)
        x = xk * np.sin((np.arange(count) + 0.5) * (0.5 * math.pi / count))
        below = self._transforms(x)
        return 2.0 * share * _SPACING * above @ above.T, share * math.pi / count * (below * x) @ below.T

    def _whole(self, outside: Numbers) -> tuple[Numbers, Numbers]:
        # Stiffness and mass of head and cylinder together.
        head, other = len(self.zeros), len(self._own)
        stiff, mass = np.zeros((head + other, head + other)), np.eye(head + other)
        stiff[:head, :head] = self._stiff
        stiff[head:, head:] = np.diag((self._own / self._load.radius_over_sound_speed_s) ** 2)
        mass[:head, :head] += outside + self._held
        mass[:head, head:] = self._drawn
        mass[head:, :head] = self._drawn.T
        return stiff, mass

    def at(self, w: float) -> tuple[Numbers, Numbers]:
        """Stiffness and mass of the head alone at w, with all of the air in the latter but what is a spring."""
        mass = np.eye(len(self.zeros)) + self._outside(w)[0] + self._held
        mass += (
            self._drawn
            * (w * self._load.radius_over_sound_speed_s) ** 2
            / (self._own**2 - (w * self._load.radius_over_sound_speed_s) ** 2)
        ) @ self._drawn.T
        return self._stiff, mass

    def solved(self, w: float) -> tuple[Numbers, Numbers]:
        """All modes by the outer air at w, the lowest first: their w, and shapes in columns that are 1 long in mass."""
        solved: Any = _linalg().eigh(*self._whole(self._outside(w)[0]))
        values, vectors = cast(tuple[Numbers, Numbers], solved)
        return np.sqrt(np.maximum(values, 0.0)), vectors

    def settled(self, w: float, rank: int) -> tuple[float, Numbers]:
        """w of the mode of this rank at its own w, looked for from there on, and its shape."""
        for _ in range(_ROUNDS):
            omegas, vectors = self.solved(w)
            first = float(omegas[rank])
            if abs(first - w) <= _CLOSE * first:
                return first, vectors[:, rank]
            second = float(self.solved(first)[0][rank])
            # Aitken: where a row of which each step is so much of the last one ends; no farther than it has come.
            bent = second - 2.0 * first + w
            ahead = -((second - first) ** 2) / bent if bent != 0.0 else 0.0
            w = second + min(max(ahead, -abs(first - w)), abs(first - w))
        raise ValueError(
            f"the air load of the mode near {w / (2.0 * math.pi):.0f} Hz: no frequency found (no convergence)"
        )

    def effective(self, w: float, shape: Numbers) -> tuple[float, float]:
        """Mass and decay of a mode with its w and shape, of which the head's part is taken as 1 long."""
        mass, loss = self._outside(w)
        beside, _ = self._outside(w * (1.0 + _APART))
        head, rest = shape[: len(self.zeros)], shape[len(self.zeros) :]
        moving = float(shape @ self._whole(mass)[1] @ shape + head @ (beside - mass) @ head / (2.0 * _APART))
        # Of w^2 moving, what the cylinder's modes hold.
        held = float(rest**2 @ (self._own / self._load.radius_over_sound_speed_s) ** 2)
        decay = 0.5 * w * float(head @ loss @ head) / moving + _WALLS * held / (w * moving)
        return moving / float(head @ head), decay


def _linalg() -> Any:
    from scipy import linalg

    return linalg


def _points(xk: float) -> int:
    # Of the sum over t in 0 .. pi/2, where x = xk sin t: b^2 turns every pi.
    return 16 + 2 * math.ceil(xk)


def _speed(load: Load, w: float) -> float:
    # c of the head whose mode (0,1) sounds at w. The air is known there: c^2 j^2 v = w^2 M v, and (0,1) is the slowest.
    order = _Order(0, load, 0.0)
    stiff, mass = order.at(w)
    solved: Any = _linalg().eigh(w * w * mass - stiff, np.diag(order.zeros**2), eigvals_only=True)
    fastest = float(cast(Numbers, solved)[-1])
    if not fastest > 0.0:
        raise ValueError(
            f"without tension the lowest mode would lie above f01_Hz = {w / (2.0 * math.pi):g} Hz: "
            "raise depth_m of the kettle, lower bending_N_m, or raise f01_Hz"
        )
    c = math.sqrt(fastest)
    if not c * load.radius_over_sound_speed_s < 1.0:
        raise ValueError(
            f"in air, f01_Hz = {w / (2.0 * math.pi):g} Hz asks for waves on the head as fast as sound"
        )
    return c


def _alone(modes: Modes, load: Load, c: float) -> _Found:
    # Each mode by itself.
    zeros = modes.zeros
    in_vacuum = np.sqrt(_stiffness(zeros, load, c))
    below_sound = _BELOW_SOUND * zeros / load.radius_over_sound_speed_s
    before = omega = np.minimum(in_vacuum, below_sound)
    mass = np.ones(len(zeros))
    for _ in range(12):
        mass = 1.0 + load.mass_ratio / np.sqrt(zeros**2 - (load.radius_over_sound_speed_s * omega) ** 2)
        before, omega = omega, np.minimum(in_vacuum / np.sqrt(mass), below_sound)
    fast = omega[(omega >= below_sound) | (np.abs(omega / before - 1.0) > _CLOSE_ALONE)]
    if len(fast):
        raise ValueError(
            f"at {fast[0] / (2.0 * math.pi):.0f} Hz waves are as fast as sound: lower bending_N_m"
        )
    # M' has the derivative of G besides.
    k_squared = (load.radius_over_sound_speed_s * omega) ** 2
    mass += 0.5 * load.mass_ratio * k_squared / np.sqrt(zeros**2 - k_squared) ** 3
    loss = np.zeros(len(zeros))
    sides = 1.0 if load.kettle_depth_radii is None else 0.5
    for order in np.unique(modes.orders):
        own = np.flatnonzero(
            (modes.orders == order)
            & (zeros > _COUPLED)
            & (load.radius_over_sound_speed_s * omega > order - 12.0)
        )
        if len(own) == 0:
            continue
        xk = load.radius_over_sound_speed_s * omega[own, None]
        count = _points(float(xk.max()))
        t = (np.arange(count) + 0.5) * (0.5 * math.pi / count)
        x = xk * np.sin(t)
        b = zeros[own, None] * bessel_between(int(order), x) / (zeros[own, None] ** 2 - x**2)
        loss[own] = math.pi / count * np.sum(b**2 * x, axis=1)
    return _Found(omega, 0.5 * sides * load.mass_ratio * omega * loss / mass, mass)


def _couple(found: InAir, load: Load, order: int, w01: float) -> _Mix:
    # Solves the modes of one order together; writes their w, decay and mass. Each of the vacuum's gets the mode that
    # has most of it, of those that are left; (0,1) the one that sounds at w01.
    columns = np.flatnonzero((found.basis.orders == order) & (found.basis.zeros <= _COUPLED))
    targets = columns[columns < len(found.f_Hz)]
    weights = np.zeros((len(columns), len(targets)))
    air = _Order(order, load, found.c)
    taken: set[int] = set()
    # b_n is the transform of J_m(j_n r) over this, sign and all.
    ends = bessel().jv(order + 1, found.basis.zeros[columns])
    for at, target in enumerate(targets):
        begin = w01 if order == at == 0 else float(found.f_Hz[target])
        omegas, shapes = air.solved(begin)
        heads = shapes[: len(columns)]
        liked = -np.abs(omegas - w01) if order == at == 0 else np.abs(heads[at])
        rank = next(int(each) for each in np.argsort(-liked) if int(each) not in taken)
        taken.add(rank)
        w, shape = air.settled(float(omegas[rank]), rank)
        mass, decay = air.effective(w, shape)
        head = shape[: len(columns)]
        v = head * math.copysign(1.0, head[at]) / float(np.linalg.norm(head))
        found.f_Hz[target], found.masses[target], found.decays[target] = w, mass, decay
        weights[:, at] = v * ends[at] / ends
    return _Mix(columns, targets, weights)
