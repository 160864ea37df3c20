"""The bank of modes of a scene's drum, at rest. Any thread; allocates.

The bank's oscillators answer to a force that is constant over a step as the sampled mode does to the same impulse.
"""

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import head_numbers
from drumstick.drum.membrane.heads import aligned, panned
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.scheme import even_losses
from drumstick.drum.memory.bank import MAX_LANES, STEPS, TILE, Bank, Blocks, HeldModes, blocks_of
from drumstick.drum.memory.pulses import POOL
from drumstick.drum.modal.air_load import InAir, in_air, zero_at
from drumstick.drum.modal.covered import Covered, covered_by, turned
from drumstick.drum.modal.modes import radial_shapes, shapes_at, tip_average
from drumstick.drum.modal.radiation import heard_by, on_place_and_movement
from drumstick.drum.output.upsample import PASS_BAND
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from realtime.records import ABSENT, is_there

MAX_MODES = 60_000  # in blocks, 0.05 to 0.1 ns each and a step: a fifth of a core at 48 kHz
# Under a mallet, or driven under tension, or while pickups move, 0.5 to 1.2 ns while that lasts.
MAX_MODES_STEP_BY_STEP = 20_000
_RADII_A_RADIAN = 2.0  # of the table of shapes, per radian of the shortest wave
_MAX_CYCLES_PER_STEP = 0.49
_CYCLES_PER_STEP = 0.45  # that a scene's highest mode may have
_CYCLES_PER_STEP_UNDER_TENSION, _CYCLES_PER_STEP_OF_LOWEST = 0.22, 1.0 / 12.0
_LEFT = 0.95  # of what a rising tension may raise, for modes that are above the highest in air
_LEAST_LEFT = 1e-3
_LOWEST = (
    192  # radial modes, at least, that a bank under tension steps one by one (drumstick.drum.modal.apart)
)
_NEPERS = 3.0 * math.log(10.0)  # 60 dB

Numbers = npt.NDArray[np.float64]


def decay_rates(drum: Drum, f_Hz: Numbers) -> Numbers:
    """sigma of each frequency, 1/s: the drum's own decay, and what its losses add."""
    inverse = np.full(len(f_Hz), 1.0 / drum.t60_s)
    inverse += head_numbers.even_losses_per_s(drum)
    rising = head_numbers.rising_loss(drum)
    if rising is not None:
        high_t60_s, high_Hz = rising
        lowest = float(inverse[0])
        rise = max(1.0 / high_t60_s - lowest, 0.0) / (high_Hz**2 - drum.f01_Hz**2)
        inverse += rise * np.maximum(f_Hz**2 - drum.f01_Hz**2, 0.0)
    return _NEPERS * inverse


def _max_cycles_per_step(scene: Scene) -> float:
    # Cycles per step of the highest mode. A tension that rises raises K = 2 - 2 cos(theta), and it must stay below 4;
    # and only well below a quarter cycle does the product q+ q, by which a mode stretches the head, depend on its
    # amplitude and not on its phase.
    rise = head_numbers.tension_rise(scene.drum)
    if rise is None:
        return _CYCLES_PER_STEP
    most = 4.0 * _LEFT / (1.0 + rise)
    return min(_CYCLES_PER_STEP_UNDER_TENSION, math.acos(max(1.0 - 0.5 * most, -1.0)) / (2.0 * math.pi))


def _max_modes(scene: Scene) -> int:
    has_steps = (
        scene.mallet is not None
        or head_numbers.tension_rise(scene.drum) is not None
        or scene.listen.pickup_places == "live"
    )
    return MAX_MODES_STEP_BY_STEP if has_steps else MAX_MODES


def highest_zero(scene: Scene, rate_Hz: float) -> float:
    """j of the highest mode that the scene asks for, that fits below half the rate, and that the bank has room for."""
    assert scene.modal is not None
    top_Hz = min(scene.modal.top_Hz, _max_cycles_per_step(scene) * rate_Hz)
    most = 2.0 * math.sqrt(_max_modes(scene))  # Weyl: (j/2)^2 modes, pairs counted
    return max(min(zero_at(top_Hz, scene.drum), most), J01)


def divisor_below(scene: Scene, rate_Hz: int) -> int:
    """Device samples a step: as many as leave the scene's highest mode in the interpolator's pass band."""
    assert scene.modal is not None
    highest_Hz = float(in_air(highest_zero(scene, rate_Hz), scene.drum).f_Hz.max())
    cycles = min(PASS_BAND, _max_cycles_per_step(scene))
    most = cycles * rate_Hz / max(scene.modal.top_Hz, highest_Hz)
    if head_numbers.tension_rise(scene.drum) is not None:
        most = min(most, _CYCLES_PER_STEP_OF_LOWEST * rate_Hz / scene.drum.f01_Hz)
    return max(1, math.floor(most))


def _by_each(
    scene: Scene, highest: float, head: InAir, theta: Numbers
) -> tuple[list[Numbers], list[Numbers] | None]:
    # Of each pickup, or microphone, (2 P,), on the modes' movements, and, for microphones, on their places.
    covered = covered_by(highest, scene.drum)

    def both(pair: Iterable[Numbers]) -> Numbers:
        return turned(np.concatenate(list(pair)), covered)

    if not scene.listen.microphones:
        places = [shapes_at(head.basis, x, y) for x, y, _ in scene.listen.pickups]
        return [both(head.mixed(values) for values in shapes) for shapes in places], None
    heard = [[on_place_and_movement(each, theta) for each in waves] for waves in heard_by(scene, highest)]
    still = [both(place for place, _ in pair) for pair in heard]
    return [both(movement for _, movement in pair) for pair in heard], still


def gains_of_each(scene: Scene, step_s: float) -> tuple[Numbers, Numbers | None]:
    """Gains of each pickup, or microphone, (sources, 2 P), on the modes' movements; those of microphones on their
    places too. Before they are panned.
    """
    highest = highest_zero(scene, 1.0 / step_s)
    head = in_air(highest, scene.drum)
    moving, still = _by_each(scene, highest, head, 2.0 * math.pi * head.f_Hz * step_s)
    return np.array(moving), None if still is None else np.array(still)


def _gains(scene: Scene, highest: float, head: InAir, theta: Numbers) -> tuple[Numbers, Numbers | None]:
    # Of left and right, shape (2, 2 P).
    moving, still = _by_each(scene, highest, head, theta)
    pans = [panned(pan) for *_, pan in scene.listen.microphones or scene.listen.pickups]

    def mixed(each: list[Numbers]) -> Numbers:
        total = np.zeros((2, 2 * len(head.f_Hz)))
        for pan, gains in zip(pans, each, strict=True):
            total += np.outer(pan, gains)
        return total

    return mixed(moving), None if still is None else mixed(still)


def bank_of(scene: Scene, step_s: float) -> Bank:
    """The scene's drum at rest, a step every `step_s`."""
    highest = highest_zero(scene, 1.0 / step_s)
    head = in_air(highest, scene.drum)
    modes, f_Hz = head.modes, head.f_Hz
    if not f_Hz.max() * step_s < _MAX_CYCLES_PER_STEP:
        raise ValueError(f"a mode at {f_Hz.max():.0f} Hz is beyond {1.0 / step_s:g} steps a second")
    # R; what is gone in a step or two shall not overflow where it is divided by.
    left_a_step = np.maximum(np.exp(-(decay_rates(scene.drum, f_Hz) + head.decays) * step_s), _LEAST_LEFT)
    theta = 2.0 * math.pi * f_Hz * step_s
    stiffness = 1.0 - 2.0 * left_a_step * np.cos(theta) + left_a_step**2
    # Over R^2: what drives a step is added to d before the step keeps R^2 of it.
    drive = head.c**2 * step_s**2 / (modes.norms * head.masses) * np.sin(theta) / theta / left_a_step
    count = max(8, math.ceil(_RADII_A_RADIAN * head.basis.zeros[-1]))
    radii = (np.arange(count + 3) - 1.0) / count
    # J_m(-x) = (-1)^m J_m(x): the row before r = 0 continues the shape as it is.
    shapes = radial_shapes(head.basis, radii)
    if scene.mallet is not None:
        shapes *= tip_average(head.basis, scene.mallet.tip_radius_m / scene.drum.radius_m)
    radial = drive * head.mixed(shapes)
    gains, still = _gains(scene, highest, head, theta)

    size = TILE * math.ceil(2 * len(f_Hz) / TILE)

    def laid(values: Numbers, last: float = 0.0) -> npt.NDArray[np.float32]:
        return np.pad(values, (0, size - len(values)), constant_values=last).astype(np.float32)

    def both(values: Numbers, last: float = 0.0) -> npt.NDArray[np.float32]:
        return laid(np.concatenate([values, values]), last)

    rises = head_numbers.tension_rise(scene.drum) is not None
    by_tension = head.of_tension() * stiffness / left_a_step**2 if rises else None
    free = Bank(
        q=np.zeros(size, np.float32),
        d=np.zeros(size, np.float32),
        r_squared=both(left_a_step**2, 1.0),
        stiffness=both(stiffness),
        left=laid(gains[0]),
        right=laid(gains[1]),
        left_by_displacement=ABSENT if still is None else laid(still[0]),
        right_by_displacement=ABSENT if still is None else laid(still[1]),
        orders=modes.orders,
        radial=np.ascontiguousarray(radial, np.float32),
        strike_weights=np.zeros((POOL, size), np.float32),
        angular=np.zeros((2, int(modes.orders.max()) + 1)),
        masses=both(1.0 / drive) if scene.mallet is not None else ABSENT,
        stretch_weights=ABSENT if by_tension is None else both(by_tension / drive),
        tension_stiffness=ABSENT if by_tension is None else both(by_tension),
    )
    covered = covered_by(highest, scene.drum)
    return free if covered is None else free._replace(held=_held(free, covered, step_s))


def _held(bank: Bank, covered: Covered, step_s: float) -> HeldModes:
    # R^2 = (1 - s)/(1 + s): see drumstick.drum.modal.held. What a step takes leaves a little of a mode.
    s = np.pad(even_losses(covered.t60_s, step_s).s * covered.shares, (0, len(bank.q) - len(covered.shares)))
    share = np.minimum(s * 0.5 * (1.0 + bank.r_squared), (1.0 - _LEAST_LEFT) * bank.r_squared)
    return HeldModes(
        share=share.astype(np.float32),
        r_squared=bank.r_squared.copy(),
        stiffness=bank.stiffness.copy(),
        drive_scale=np.ones(len(bank.q), np.float32),
        turn=covered.turn.astype(np.float32),
        masses=bank.masses.copy() if is_there(bank.masses) else ABSENT,
        tension_stiffness=bank.tension_stiffness.copy() if is_there(bank.tension_stiffness) else ABSENT,
    )


def blocks_for(scene: Scene, bank: Bank) -> Blocks:
    """Memory of the steps that the bank takes at once; none under tension where there are few modes."""
    lowest = 0
    if head_numbers.tension_rise(scene.drum) is not None:
        radial_modes = len(bank.orders)
        # The others are whole tiles, cosines and sines.
        lowest = radial_modes - (radial_modes - _LOWEST) // TILE * TILE
        if not _LOWEST <= lowest < radial_modes:
            return ABSENT
    return blocks_of(aligned((STEPS, 2, MAX_LANES)), lowest)
