"""Error of a played roll against another: its first contacts, and the speed and the rate of its limit cycle.

Contacts have shape (n, 5) or more, columns as drumstick.stick.simulate.COLUMNS: t_in (s), v_in (m/s), t_out (s), v_out
(m/s), v_E (m/s). Any thread.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.stick.simulate import COLUMNS

Contacts = npt.NDArray[np.float64]

COMPARED = 10  # contacts
# The default roll's multiplier is 0.694 (`drumstick analyse`): after so many contacts the throw is forgotten to 1e-16.
SETTLED = 100
AVERAGED = 100  # contacts; without event location each one falls elsewhere in its step
_INSTANTS_AND_SPEEDS = 4  # columns
_T_IN, _V_E = COLUMNS.index("t_in_s"), COLUMNS.index("v_e_m_per_s")


class Cycle(NamedTuple):
    """A roll's limit cycle as it was played: mean v_E (m/s), contacts a second."""

    v_lc_m_per_s: float
    rate_Hz: float


class Errors(NamedTuple):
    """Relative errors. None: there is no such number, because contacts are missing or grow without end."""

    contacts: float | None
    v_lc: float | None
    rate: float | None


def largest_error(found: Contacts, true: Contacts) -> float:
    """The largest relative error of any number in `true`, shape (n, columns); inf if contacts are missing."""
    if len(found) < len(true):
        return math.inf
    return float(np.max(np.abs(found[: len(true), : true.shape[1]] / true - 1.0)))


def cycle_of(contacts: Contacts) -> Cycle | None:
    """The cycle after SETTLED contacts, over the AVERAGED next; None when there are not so many."""
    settled = contacts[SETTLED : SETTLED + AVERAGED]
    if len(settled) < AVERAGED:
        return None
    lasted_s = settled[-1, _T_IN] - settled[0, _T_IN]
    return Cycle(float(np.mean(settled[:, _V_E])), float((AVERAGED - 1) / lasted_s))


def finite(value: float) -> float | None:
    """JSON has no infinity and no NaN: None."""
    return value if math.isfinite(value) else None


def errors(found: Contacts, true: Contacts) -> Errors:
    """Errors of `found` against `true`, a roll of at least SETTLED + AVERAGED contacts."""
    first = finite(largest_error(found, true[:COMPARED, :_INSTANTS_AND_SPEEDS]))
    own, wanted = cycle_of(found), cycle_of(true)
    if own is None or wanted is None:
        return Errors(first, None, None)
    v_lc, rate = (finite(abs(one / other - 1.0)) for one, other in zip(own, wanted, strict=True))
    return Errors(first, v_lc, rate)
