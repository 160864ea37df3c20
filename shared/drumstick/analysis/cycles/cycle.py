"""A cycle of the return map: a roll, or an alternation, that repeats after `period` contacts; stable or not.

Any thread; blocks for milliseconds.
"""

from dataclasses import dataclass, field

import numpy as np

from drumstick.analysis.cycles import multiplier, return_step
from drumstick.analysis.cycles.return_step import Numbers
from drumstick.stick.effects.decaying_pulse import IGNORE
from drumstick.stick.motion import exact
from realtime.records import Records

_NEWTON_STEPS = 8
_CLOSED = 1e-11  # of the speed: what may be missing after one round
_SAME = 1e-6


@dataclass(frozen=True)
class Cycle:
    """v_e, v_in, apex and contact time are those of the cycle's strongest contact, the one with the largest v_E.

    apex_m: the height from which the stick falls into that contact. multiplier: of the whole round, the dominant one; a
    complex pair by its modulus. states: after each contact, shape (period, 5).

    >>> import drumstick as ds
    >>> roll = ds.analyse(ds.scene("roll")).cycles[0]
    >>> round(roll.rate_Hz, 2), round(roll.multiplier, 3), roll.stable
    (23.05, 0.694, True)
    """

    v_e_m_per_s: float
    v_in_m_per_s: float
    rate_Hz: float
    apex_m: float
    contact_s: float
    multiplier: float
    period: int
    states: Numbers = field(repr=False)

    @property
    def stable(self) -> bool:
        """True when a small departure dies away."""
        return abs(self.multiplier) < 1.0

    def passes(self, state: Numbers) -> bool:
        """True when `state` is one of the cycle's own."""
        scale = float(np.sum(np.abs(self.states[0, : return_step.PULSE_AGE])))
        apart = np.abs(self.states[:, : return_step.PULSE_AGE] - state[: return_step.PULSE_AGE]).sum(axis=1)
        return bool(np.min(apart) <= _SAME * scale)


def _polished(law: Records, scratch: Records, state: Numbers, period: int) -> Numbers | None:
    # Newton's method on the whole state; None when no motion through here closes.
    kept = multiplier.active(law)
    best, missing = None, np.inf
    for _ in range(_NEWTON_STEPS):
        end = multiplier.after(law, scratch, state, period)
        if end is None:
            break
        apart = end[kept] - state[kept]
        scale = float(np.sum(np.abs(state[kept])))
        gap = float(np.sum(np.abs(apart)))
        if gap >= missing:
            break
        best, missing = end, gap
        best[kept] = state[kept]  # the ages are those that the round itself brings back
        if gap <= 1e-15 * scale:
            break
        matrix = multiplier.jacobian(law, scratch, state, period)
        if matrix is None:
            break
        step = np.linalg.lstsq(np.eye(len(kept)) - matrix, apart, rcond=None)[0]
        state = best.copy()
        state[kept] += step
        if not state[return_step.V_OUT] > 0.0:
            break
    if best is None or missing > _CLOSED * float(np.sum(np.abs(best[kept]))):
        return None
    return best


def _ages_close(law: Records, start: Numbers, end: Numbers) -> bool:
    # With overlap = "ignore" how long ago a pulse fired is part of the motion: it may fire again only contacts later.
    names = law.dtype.names or ()
    for name, left, age in (
        ("pulse", return_step.PULSE, return_step.PULSE_AGE),
        ("cor_pulse", return_step.COR_PULSE, return_step.COR_PULSE_AGE),
    ):
        counts = name in names and int(law[name]["overlap"][0]) == IGNORE and start[left] != 0.0
        if counts and not abs(end[age] - start[age]) <= _SAME * start[age]:
            return False
    return True


def close(law: Records, scratch: Records, state: Numbers, period: int) -> Cycle | None:
    """The cycle of this period next to `state` (shape (5,)); None when there is none, or when it repeats sooner."""
    found = _polished(law, scratch, state, period)
    if found is None:
        return None
    matrix = multiplier.jacobian(law, scratch, found, period)
    if matrix is None:
        return None
    measured, states = (
        np.zeros((period, return_step.MEASURED_SIZE)),
        np.zeros((period, return_step.STATE_SIZE)),
    )
    return_step.set_state(law[0], scratch[1:], scratch[:1], found)
    if (
        return_step.iterate(law[0], scratch[0], states, return_step.MAX_WAIT_DOUBLINGS, measured)
        != exact.MOVING
    ):
        return None
    if not _ages_close(law, found, states[-1]):
        return None
    for shorter in range(1, period):
        apart = np.abs(states[shorter - 1] - states[-1])[: return_step.PULSE_AGE].sum()
        if apart <= _SAME * np.abs(states[-1, : return_step.PULSE_AGE]).sum():
            return None
    strongest = measured[int(np.argmax(measured[:, return_step.V_E]))]
    return Cycle(
        float(strongest[return_step.V_E]),
        float(strongest[return_step.V_IN]),
        float(period / measured[:, return_step.PERIOD_S].sum()),
        float(strongest[return_step.APEX_M]),
        float(strongest[return_step.CONTACT_S]),
        multiplier.dominant(matrix),
        period,
        states,
    )
