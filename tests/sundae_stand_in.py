"""scikit-sundae's CVODE as far as the laboratory asks it, by scipy: for tests where it is not installed."""

import sys
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import integrate

_integrate: Any = integrate  # scipy publishes no types


class CVODE:
    """Likewise: `rhsfn` and `eventsfn` fill arrays; a step ends at the first of the terminal events."""

    def __init__(
        self,
        rhsfn: Any,
        *,
        eventsfn: Any,
        num_events: int,
        method: str,
        rtol: float,
        atol: float,
        max_num_steps: int,
    ) -> None:
        assert method in ("Adams", "BDF")
        assert max_num_steps > 0
        assert eventsfn.terminal == [True] * num_events
        self._rhs, self._events, self._rtol, self._atol = rhsfn, eventsfn, rtol, atol

    def init_step(self, t0: float, y0: Any) -> None:
        self._t, self._y = t0, np.asarray(y0, float)

    def _one(self, at: int) -> Any:
        def event(t: float, y: Any) -> float:
            found = np.full(len(self._events.direction), np.nan)
            self._events(t, y, found)
            return float(found[at])

        named: Any = event
        named.terminal, named.direction = True, self._events.direction[at]
        return event

    def step(self, t: float) -> Any:
        def rate(now: float, y: Any) -> Any:
            filled = np.full(len(y), np.nan)
            self._rhs(now, y, filled)
            return filled

        found = _integrate.solve_ivp(
            rate, (self._t, t), self._y, method="DOP853", rtol=self._rtol, atol=self._atol,
            events=[self._one(at) for at in range(len(self._events.direction))],
        )  # fmt: skip
        which = [[int(len(times) > 0) for times in found.t_events]]
        return SimpleNamespace(
            status=2 if found.status == 1 else 0, t=found.t[-1], y=found.y[:, -1], i_events=np.array(which)
        )


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `import sksundae` find this where it would find nothing."""
    if find_spec("sksundae") is not None:
        return
    package, inner = ModuleType("sksundae"), ModuleType("sksundae.cvode")
    package.__spec__ = ModuleSpec("sksundae", None)
    vars(inner)["CVODE"], vars(package)["cvode"] = CVODE, inner
    monkeypatch.setitem(sys.modules, "sksundae", package)
    monkeypatch.setitem(sys.modules, "sksundae.cvode", inner)
