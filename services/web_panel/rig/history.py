"""The last ten seconds, for the plots. Pure but for what it keeps; one thread."""

from collections import deque
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from web_panel.rig.rig_state import RigState

SPAN_S = 10.0

Columns = npt.NDArray[np.float64]


class _Sample(NamedTuple):
    at: float
    rate_Hz: float
    v_e_m_per_s: float
    z_m: float
    v_m_per_s: float
    speed_m_per_s: float


class _Contact(NamedTuple):
    at: float
    contact_s: float
    peak_N: float


class PlotHistory:
    """Recent strikes, releases and states, for the plots. `now` is the clock of the state's times, s."""

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque()
        self._contacts: deque[_Contact] = deque()
        self._v_e: deque[tuple[float, int, float]] = deque()  # at, the strike's number, v_E after it
        self._strikes: deque[tuple[float, float, float]] = deque()  # at, speed, level
        self._boot: int | None = None

    def take(self, rig_state: RigState, now: float) -> None:
        """Take what is new, and forget what is old."""
        speed = rig_state.strike.z_speed_m_per_s if rig_state.strike is not None else 0.0
        for at, state in rig_state.new_states:
            if state.boot != self._boot:
                self._boot = state.boot
                self._v_e.clear()
            self._samples.append(
                _Sample(at, state.roll_rate_Hz, state.v_e_m_per_s, state.z_m, state.v_m_per_s, speed)
            )
            # In the head, v_e is still that of the contact before.
            number = state.strikes if state.z_m >= 0.0 else state.strikes - 1
            if number > 0 and (not self._v_e or number > self._v_e[-1][1]):
                self._v_e.append((at, number, state.v_e_m_per_s))
        self._contacts.extend(
            _Contact(at, release.contact_s, release.peak_N) for at, release in rig_state.new_releases
        )
        self._strikes.extend(
            (at, strike.z_speed_m_per_s, strike.level) for at, strike in rig_state.new_strikes
        )
        for kept in (self._samples, self._contacts, self._v_e, self._strikes):
            while kept and kept[0][0] < now - SPAN_S:
                kept.popleft()

    def roll(self, now: float) -> Columns:
        """Age (s, <= 0), roll rate (Hz), v_E and strike speed (m/s), shape (4, n)."""
        rows = [(s.at - now, s.rate_Hz, s.v_e_m_per_s, s.speed_m_per_s) for s in self._samples]
        return np.array(rows, np.float64).reshape(-1, 4).T

    def contacts(self, now: float) -> Columns:
        """Age (s, <= 0), contact time (ms) and largest force (N) of each contact, shape (3, n)."""
        rows = [(c.at - now, 1e3 * c.contact_s, c.peak_N) for c in self._contacts]
        return np.array(rows, np.float64).reshape(-1, 3).T

    def strikes(self) -> Columns:
        """Speed (m/s) and level of each strike, shape (2, n)."""
        return np.array([(speed, level) for _, speed, level in self._strikes], np.float64).reshape(-1, 2).T

    def orbit(self, now: float, span_s: float) -> Columns:
        """Height (mm) and speed (m/s) wherever the servo was heard in the last seconds, shape (2, n)."""
        rows = [(1e3 * s.z_m, s.v_m_per_s) for s in self._samples if s.at >= now - span_s]
        return np.array(rows, np.float64).reshape(-1, 2).T

    def steps(self) -> Columns:
        """v_E after a contact and after the very next one, m/s, shape (2, n)."""
        known = {number: v_e for _, number, v_e in self._v_e}
        rows = [(v_e, known[number + 1]) for number, v_e in known.items() if number + 1 in known]
        return np.array(rows, np.float64).reshape(-1, 2).T
