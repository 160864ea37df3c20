"""The step written down by hand, for three scenes: no effect, `pulse`, and `pulse` with two alterations of the head.

Semi-implicit Euler without event location (drumstick.stick.motion.stepping.unlocated), release "paper": the equations,
the events and the contact's record stand in one loop, parameters and state are plain numbers, and whatever does not
change is computed before the loop. Only what ends a run (captured, left) is missing: the scenes here do not end. It is
what the composed kernels are measured against; the result is the same to the last bit.
"""

import math
from typing import NamedTuple

from realtime.kernels.jit import njit


class Stick(NamedTuple):
    """m, k_coll, r_in, k_hand, r_out, z_ss in SI units."""

    m: float
    k_coll: float
    r_in: float
    k_hand: float
    r_out: float
    z_ss: float


class Blow(NamedTuple):
    """The present or last contact: v_in, v_out, z_min, z_apex, peak_N, impulse_N_s, contact_s."""

    v_in: float
    v_out: float
    z_min: float
    z_apex: float
    peak_N: float
    impulse_N_s: float
    contact_s: float


@njit()
def none(stick: Stick, z: float, v: float, dt: float, steps: int) -> tuple[float, float, Blow]:
    """No effect."""
    m, k, r = stick.m, stick.k_coll, stick.r_in - stick.r_out
    g = stick.k_hand * stick.z_ss / m
    a_above, w2_above = 0.5 * stick.r_out / m, stick.k_hand / m
    a_inside, w2_inside = 0.5 * (stick.r_out + r) / m, (stick.k_hand + k) / m
    inside = False
    v_in, v_out, z_min, z_apex, peak, impulse, contact = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(steps):
        a, w2 = (a_inside, w2_inside) if inside else (a_above, w2_above)
        z0, v0 = z, v
        v = v0 + dt * (g - 2.0 * a * v0 - w2 * z0)
        z = z0 + dt * v
        if inside:
            travel = z - z0
            impulse += 0.0 - r * travel
            impulse -= k * ((0.0 - (v - v0) - 2.0 * a * travel + g * dt) / w2)
            peak = max(peak, -k * z - r * v)
            contact += dt
            if z >= 0.0:
                inside, v_out, z_apex = False, v, z
            elif v0 < 0.0 <= v:
                z_min = min(z_min, z)
        elif z < 0.0:
            inside, v_in, v_out, z_min = True, v, 0.0, z
            peak, impulse, contact = max(0.0, -k * z - r * v), 0.0, 0.0
        elif v0 > 0.0 >= v:
            z_apex = z
    return z, v, Blow(v_in, v_out, z_min, z_apex, peak, impulse, contact)


@njit()
def pulsed(
    stick: Stick, dv: float, tau: float, z: float, v: float, dt: float, steps: int
) -> tuple[float, float, Blow]:
    """`pulse`, fired at release, upward, overlap "add"."""
    m, k, r = stick.m, stick.k_coll, stick.r_in - stick.r_out
    g = stick.k_hand * stick.z_ss / m
    a_above, w2_above = 0.5 * stick.r_out / m, stick.k_hand / m
    a_inside, w2_inside = 0.5 * (stick.r_out + r) / m, (stick.k_hand + k) / m
    fade, push = math.exp(-(1.0 / tau) * dt), 0.0
    inside = False
    v_in, v_out, z_min, z_apex, peak, impulse, contact = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(steps):
        a, w2 = (a_inside, w2_inside) if inside else (a_above, w2_above)
        z0, v0, push0 = z, v, push
        v = v0 + dt * (g - 2.0 * a * v0 - w2 * z0 + push0)
        z = z0 + dt * v
        push = push0 * fade
        if abs(push) * tau < 1e-25:
            push = 0.0
        if inside:
            travel = z - z0
            impulse += 0.0 - r * travel
            given = push0 * tau - push * tau
            impulse -= k * ((given - (v - v0) - 2.0 * a * travel + g * dt) / w2)
            peak = max(peak, -k * z - r * v)
            contact += dt
            if z >= 0.0:
                inside, v_out, z_apex = False, v, z
                push = dv / tau + push
            elif v0 < 0.0 <= v:
                z_min = min(z_min, z)
        elif z < 0.0:
            inside, v_in, v_out, z_min = True, v, 0.0, z
            peak, impulse, contact = max(0.0, -k * z - r * v), 0.0, 0.0
        elif v0 > 0.0 >= v:
            z_apex = z
    return z, v, Blow(v_in, v_out, z_min, z_apex, peak, impulse, contact)


@njit()
def altered(
    stick: Stick,
    dv: float,
    tau: float,
    ratio: float,
    lowered: float,
    below: float,
    z: float,
    v: float,
    dt: float,
    steps: int,
) -> tuple[float, float, Blow]:
    """`pulse` as above, `hysteretic_spring`, and `negative_damping` that leaves `lowered` of R_in in slow contacts."""
    m, k, r = stick.m, stick.k_coll, stick.r_in - stick.r_out
    g = stick.k_hand * stick.z_ss / m
    a_above, w2_above = 0.5 * stick.r_out / m, stick.k_hand / m
    a, w2 = a_above, w2_above
    fade, push = math.exp(-(1.0 / tau) * dt), 0.0
    inside = False
    v_in, v_out, z_min, z_apex, peak, impulse, contact = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(steps):
        z0, v0, push0 = z, v, push
        v = v0 + dt * (g - 2.0 * a * v0 - w2 * z0 + push0)
        z = z0 + dt * v
        push = push0 * fade
        if abs(push) * tau < 1e-25:
            push = 0.0
        if inside:
            travel = z - z0
            impulse += 0.0 - r * travel
            given = push0 * tau - push * tau
            impulse -= k * ((given - (v - v0) - 2.0 * a * travel + g * dt) / w2)
            peak = max(peak, -k * z - r * v)
            contact += dt
            if z >= 0.0:
                inside, v_out, z_apex = False, v, z
                push = dv / tau + push
                a, w2 = a_above, w2_above
            elif v0 < 0.0 <= v:
                z_min = min(z_min, z)
                k = stick.k_coll * ratio
                w2 = (stick.k_hand + k) / m
                peak = max(peak, -k * z - r * v)
            elif v0 > 0.0 >= v:
                k = stick.k_coll
                w2 = (stick.k_hand + k) / m
                peak = max(peak, -k * z - r * v)
        elif z < 0.0:
            inside, v_in, v_out, z_min = True, v, 0.0, z
            impulse, contact = 0.0, 0.0
            taken = stick.r_in - lowered if -v < below else 0.0
            k, r = stick.k_coll, stick.r_in - taken - stick.r_out
            a, w2 = 0.5 * (stick.r_out + r) / m, (stick.k_hand + k) / m
            peak = max(0.0, -k * z - r * v)
        elif v0 > 0.0 >= v:
            z_apex = z
    return z, v, Blow(v_in, v_out, z_min, z_apex, peak, impulse, contact)
