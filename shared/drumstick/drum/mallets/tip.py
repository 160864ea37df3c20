"""The contact law of a mallet's tip, F = K d^p (1 + lambda d') and never a pull, over one step of the head.

d is how deep the tip is pressed in, d = x - y with the mallet at x and the head at y, both counted the way of the blow.
Without the push F of this step they would come to d = free; each newton takes c of it (`compliance`). With V = K
d^(p+1)/(p+1) the push is taken between the step before and the one to come (Chatziioannou and van Walstijn, "Energy
conserving schemes for the simulation of musical instrument contact dynamics", J. Sound Vib. 339, 2015; the loss is that
of Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42, 1975):

    F(d+) = max(0, (V(d+) - V(d-))/(d+ - d-) + lambda K d^p (d+ - d-)/2T),      d+ + c F(d+) = free

No energy is ever made, however roughly this is solved. A mallet gains -F (x+ - x-)/2 in a step and the head, which
moves by the same F, F (y+ - y-)/2; so with (V(d+) + V(d))/2 the whole gains (V(d+) - V(d-))/2 - F (d+ - d-)/2, which is
at most 0 if F (d+ - d-) >= V(d+) - V(d-). F(d+) fulfils that: its loss has the sign of d+ - d-, and where 0 takes its
place it would be negative, with d+ < d-. The left side grows with d+, at least as fast as d+ itself, so there is one
solution. V' is convex for p >= 1, hence so is the left side, and from its first step on Newton's method comes down to
the solution and never passes it. It ends at some s above the solution. While the tip goes in (the solution is above d-)
d+ = max(d-, free - c F(s)) is taken, which is not above it, so that F = (free - d+)/c is not less than F(d+);
while it comes out d+ = min(s, d-), and F is not more than F(d+). In both cases the inequality holds.

That a mesh (drumstick.drum.mallets.patch) and a bank of modes (drumstick.drum.modal.bank) gain F (y+ - y-)/2 is a
matter of pushing with the very shares by which they are read. Kernels: audio thread; no allocation.
"""

import math

from drumstick.drum.memory.mallets import Tip
from realtime.kernels.jit import njit

MAX_ROUNDS = (
    20  # from far away each doubles the depth: 15 for a tip a million times stiffer than what it meets
)
_CLOSE = 1e-6  # of the push, -120 dB: no energy is made however rough it is, and each round costs a sixth of a touch
_ROUNDING = 1e-16
_NOTHING = 1e-150  # m: over less than that nothing can be divided
_NEAR = 1e-5  # depths so near to each other have the gradient of V as the mean of both, to 1e-11


@njit()
def elastic_force(tip: Tip, depth: float) -> float:
    """V' = K d^p, N."""
    if depth <= 0.0:
        return 0.0
    if tip.twice_exponent == 0:
        return float(tip.stiffness * depth**tip.exponent)
    # Products and a root: a fifth of the time of a power.
    force = tip.stiffness * math.sqrt(depth) if tip.twice_exponent & 1 else tip.stiffness
    for _ in range(tip.twice_exponent >> 1):
        force *= depth
    return float(force)


@njit()
def _energy(tip: Tip, depth: float, push: float) -> float:
    return float(tip.energy_factor * push * max(depth, 0.0))


@njit()
def _force(tip: Tip, after: float) -> tuple[float, float]:
    # F and how fast it grows with d+.
    push = elastic_force(tip, after)
    moved = after - tip.depth_before
    loss = tip.loss_rate * tip.elastic_force
    if abs(moved) <= _NEAR * (abs(after) + abs(tip.depth_before)) + _NOTHING:
        force = 0.5 * (push + tip.elastic_force_before)
        rise = 0.5 * tip.exponent * push / after if after > 0.0 else 0.0
    else:
        inverse = 1.0 / moved
        force = (_energy(tip, after, push) - tip.energy_before) * inverse
        rise = (push - force) * inverse
    force += loss * moved
    if force <= 0.0:
        return 0.0, 0.0
    return force, rise + loss


@njit()
def solve_contact(tip: Tip, free: float) -> tuple[float, float]:
    """d+ and F of this step, from where the two would be without F."""
    before = tip.depth_before
    if free <= 0.0 and before <= 0.0 and tip.depth <= 0.0:
        tip.guess = free
        return free, 0.0
    goes_in = before + tip.compliance * tip.elastic_force_before < free
    after = min(free, max(tip.guess, 0.0))
    if goes_in:
        after = max(after, before)
    force, at = 0.0, free
    for _ in range(MAX_ROUNDS):
        at = after
        force, rise = _force(tip, at)
        wrong = at + tip.compliance * force - free
        slack = _ROUNDING * (abs(at) + abs(free))
        if -slack <= wrong <= _CLOSE * tip.compliance * force + slack:
            break
        after = min(at - wrong / (1.0 + tip.compliance * rise), free)
    if goes_in:
        if at != after or at < before:
            force = _force(tip, max(after, before))[0]
        after = max(before, free - tip.compliance * force)
    else:
        after = min(after, before, free)
    tip.guess = after
    return after, (free - after) / tip.compliance


@njit()
def advance_tip(tip: Tip, after: float) -> None:
    """The step is over: its d+ is the depth now."""
    tip.guess = 3.0 * (after - tip.depth) + tip.depth_before
    tip.depth_before, tip.energy_before, tip.elastic_force_before = tip.depth, tip.energy, tip.elastic_force
    tip.depth = after
    tip.elastic_force = elastic_force(tip, after)
    tip.energy = _energy(tip, after, tip.elastic_force)


@njit()
def reset_tip(tip: Tip, depth: float, depth_before: float) -> None:
    """Begin anew, out of touch: both depths are at most 0."""
    tip.depth, tip.depth_before = depth, depth_before
    tip.energy = tip.energy_before = tip.elastic_force = tip.elastic_force_before = 0.0
    tip.guess = 2.0 * depth - depth_before
