"""The same contacts to 30 digits: what an integrator found, with every event's instant solved for again by mpmath.

Between two events the equations (1), (2) and (4) are linear:
    y = A exp(l1 t) + B exp(l2 t) + P exp(-t/tau) + rest,    l = -a +- sqrt(a^2 - w2),    P = p/(tau^-2 - 2a/tau + w2).
Nothing of ours is in it but the scene's numbers. The order of the events is the integrator's; that an event moves by no
more than its tolerance is checked.
"""

import mpmath as mp
import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.sticks.solve_ivp_stick import ENTRY, RELEASE, TURN, Case, Played

DIGITS = 40
_AGREE = 1e-6  # of a stretch's length


class _Motion:
    # One stretch: z, v and the rest of the pulse t seconds into it.
    def __init__(self, case: Case, in_contact: bool, z: mp.mpf, v: mp.mpf, p: mp.mpf) -> None:
        m, k, r = mp.mpf(case.m), mp.mpf(case.k_hand), mp.mpf(case.r_out)
        self.rest = mp.mpf(case.z_ss)
        if in_contact:
            stiffness = k + mp.mpf(case.k_coll)
            self.rest, k, r = k * self.rest / stiffness, stiffness, mp.mpf(case.r_in)
        a, w2, self.lam, self.p = r / (2 * m), k / m, 1 / mp.mpf(case.tau), p
        split = mp.sqrt(mp.mpc(a * a - w2))
        self.first, self.second = -a + split, -a - split
        self.forced = p / (self.lam**2 - 2 * a * self.lam + w2)
        z, v = z - self.rest - self.forced, v + self.lam * self.forced
        self.of_first = (v - self.second * z) / (self.first - self.second)
        self.of_second = z - self.of_first

    def at(self, t: mp.mpf) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
        fade = mp.exp(-self.lam * t)
        one, two = self.of_first * mp.exp(self.first * t), self.of_second * mp.exp(self.second * t)
        z = mp.re(one + two) + self.forced * fade + self.rest
        v = mp.re(self.first * one + self.second * two) - self.lam * self.forced * fade
        return z, v, self.p * fade


def _surface(case: Case, end: int, z: mp.mpf, v: mp.mpf) -> mp.mpf:
    if end in (ENTRY, RELEASE):
        return z
    if end == TURN:
        return v
    return -mp.mpf(case.k_coll) * z - (mp.mpf(case.r_in) - mp.mpf(case.r_out)) * v


def _instant(case: Case, motion: _Motion, end: int, guess: mp.mpf) -> mp.mpf:
    def off(t: mp.mpf) -> mp.mpf:
        return _surface(case, end, *motion.at(t)[:2])

    t = mp.findroot(off, (guess, guess * (1 + mp.mpf(10) ** -9)), tol=mp.mpf(10) ** -60)
    assert abs(t - guess) < _AGREE * guess
    return t


def contacts(scene: Scene, found: Played, v0: float = 0.4) -> npt.NDArray[np.float64]:
    """t_in, v_in, t_out, v_out of the contacts that `found` has, rounded once; shape (count, 4)."""
    case = Case(scene)
    rows: list[tuple[mp.mpf, ...]] = []
    with mp.workdps(DIGITS):
        t, z, v, p = mp.mpf(0), mp.mpf(0), mp.mpf(v0), mp.mpf(0)
        kick = mp.mpf(case.kick)
        entry = (t, v)
        for stretch in found.stretches:
            p += kick if stretch.fired else 0
            motion, end, guess = (
                _Motion(case, stretch.in_contact, z, v, p),
                stretch.ended_by,
                mp.mpf(stretch.duration_s),
            )
            duration = _instant(case, motion, end, guess)
            z, v, p = motion.at(duration)
            t += duration
            if end == ENTRY:
                entry = (t, v)
            elif end == RELEASE:
                rows.append((*entry, t, v))
            z = mp.mpf(0) if end in (ENTRY, RELEASE) else z
    return np.array([[float(x) for x in row] for row in rows])
