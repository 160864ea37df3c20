"""The contact law, and what it implies for one blow without hand or pulse: rebound, duration, peak force.

With zeta = R_in/(2 sqrt(m K)) and w0 = sqrt(K/m), z'' passes through zero, and so does the force of a
membrane that only pushes, at w_d t = 2 acos(zeta); the force peaks where z''' does. Derived from z = -(v/w_d)
e^(-a t) sin(w_d t) and compared with the 40-digit reference in tests/physics. Kernels: any thread; no
allocation.
"""

import math

from realtime.kernels.jit import njit

PAPER, UNILATERAL = 0, 1


@njit()
def force(k_coll: float, r_head: float, z: float, v: float) -> float:
    """Force of the head on the stick while in contact, N: -K_coll z - R z'.

    R is the head's own damping, R_in - R_out: the hand's R_out of equation (1) is still there inside, and
    R_in of equation (2) is what both give together.
    """
    return -k_coll * z - r_head * v


@njit()
def damping_ratio(m: float, k_coll: float, r_in: float) -> float:
    """zeta = R_in / (2 sqrt(m K_coll))."""
    return r_in / (2.0 * math.sqrt(m * k_coll))


@njit()
def beta_eq3(m: float, k_coll: float, r_in: float) -> float:
    """Coefficient of restitution by equation (3); NaN-free: 0 when overdamped (no release at z = 0 ever)."""
    under = 4.0 * m * k_coll - r_in * r_in
    return math.exp(-r_in * math.pi / math.sqrt(under)) if under > 0.0 else 0.0


@njit()
def _angle_over_sine(zeta: float) -> float:
    # acos(z)/sqrt(1-z^2), continued through z = 1 by acosh(z)/sqrt(z^2-1)
    if abs(zeta - 1.0) < 1e-6:
        return 1.0 - (zeta - 1.0) / 3.0
    if zeta < 1.0:
        return math.acos(zeta) / math.sqrt(1.0 - zeta * zeta)
    return math.acosh(zeta) / math.sqrt(zeta * zeta - 1.0)


@njit()
def beta_unilateral(m: float, k_coll: float, r_in: float) -> float:
    """Restitution of a head that only pushes: exp(-2 zeta acos(zeta)/sqrt(1-zeta^2)), for every zeta."""
    zeta = damping_ratio(m, k_coll, r_in)
    return math.exp(-2.0 * zeta * _angle_over_sine(zeta))


@njit()
def beta(release: int, m: float, k_coll: float, r_in: float) -> float:
    """Coefficient of restitution of the scene's release rule."""
    return beta_eq3(m, k_coll, r_in) if release == PAPER else beta_unilateral(m, k_coll, r_in)


@njit()
def contact_time(release: int, m: float, k_coll: float, r_in: float) -> float:
    """Duration of contact, s. An overdamped `paper` contact never ends: it gets the time the head pushes."""
    w0 = math.sqrt(k_coll / m)
    zeta = damping_ratio(m, k_coll, r_in)
    if release == PAPER and zeta < 1.0:
        return math.pi / (w0 * math.sqrt(1.0 - zeta * zeta))
    return 2.0 * _angle_over_sine(zeta) / w0


@njit()
def peak_force(m: float, k_coll: float, r_in: float, speed: float) -> float:
    """Largest force of a blow at `speed` > 0, N: the spring's for zeta < 1/2, else the damper's at entry."""
    zeta = damping_ratio(m, k_coll, r_in)
    if zeta >= 0.5:
        return r_in * speed
    turn = (3.0 * math.acos(zeta) - math.pi) / math.sqrt(1.0 - zeta * zeta)  # w0 times the time of the peak
    return speed * math.sqrt(m * k_coll) * math.exp(-zeta * turn)
