"""Offline simulation: the contacts of a stick thrown from z = 0, by any method.

Any thread; blocks while it computes.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick import composition
from drumstick.stick.law import law_of, thrown
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.motion import exact, stepping
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

End = Literal["time", "captured", "left"]
EXACT = "exact"
METHODS = (EXACT, *STEPPERS)
COLUMNS = (
    "t_in_s",
    "v_in_m_per_s",
    "t_out_s",
    "v_out_m_per_s",
    "v_e_m_per_s",
    "peak_force_N",
    "impulse_N_s",
    "z_min_m",
)
ENDS: dict[int, End] = {exact.MOVING: "time", exact.CAPTURED: "captured", exact.LEFT: "left"}
_BLOCK = 1024
LOWEST_DT_S, HIGHEST_DT_S = 1e-9, 0.1


@dataclass(frozen=True)
class Run:
    """`contacts` has shape (n, 8), columns as COLUMNS, only contacts that ended; `end` says why it stopped."""

    contacts: npt.NDArray[np.float64]
    end: End
    t_end_s: float


@dataclass(frozen=True)
class Stepper:
    """A method with a time step: its name, dt_s, and whether it looks for the instants of its events.

    Raises ValueError in words when there is no such stepper or no such step.

    >>> import drumstick as ds
    >>> ds.simulate(ds.scene("roll"), 2.0, stepper=ds.Stepper("rk4", 1e-5))
    Run(roll: 46 contacts in 2 s, 23.1 Hz)
    """

    name: str
    dt_s: float
    locates: bool = True

    def __post_init__(self) -> None:
        if self.name not in STEPPERS:
            raise ValueError(f"no stepper {self.name!r}; there is: {', '.join(STEPPERS)}")
        if not LOWEST_DT_S <= self.dt_s <= HIGHEST_DT_S:
            raise ValueError(
                f"a step of {self.dt_s:g} s is outside {LOWEST_DT_S:g} .. {HIGHEST_DT_S:g} s; try 1e-5"
            )


@njit()
def _next(
    law: Law, motion: Motion, horizon: float, method: int | None, dt: float, locates: bool
) -> tuple[int, float]:
    if method is None:  # decided by the type, at compile time: no stepper's code for `exact`
        return exact.advance(law, motion, horizon)
    if locates:
        return stepping.located(law, motion, horizon, method, dt)
    return stepping.unlocated(law, motion, horizon, method, dt)


@njit()
def has_left_head(motion: Motion, event: int) -> bool:
    """True when a contact has ended by this event."""
    return event == exact.RELEASE and motion.outcome != exact.CAPTURED


@njit()
def fill(law: Law, motion: Motion, t: float, lost: float, row: npt.NDArray[np.float64]) -> None:
    """Fill a row, columns as COLUMNS, with the contact that has ended at t s; `lost`: what rounding took from t."""
    row[0] = t - (motion.contact_s + lost)
    row[1] = motion.v_in
    row[2] = t
    row[3] = motion.v_out
    row[4] = motion.v_out + composition.remaining_speed(law, motion)
    row[5] = motion.peak_N
    row[6] = motion.impulse_N_s
    row[7] = motion.z_min


@njit()
def count(clock: npt.NDArray[np.float64], moved: float) -> None:
    """Add `moved` s to clock[0] by Kahan's sum, so that a long run does not drift; clock[1]: what rounding took."""
    gain = moved - clock[1]
    t = clock[0] + gain
    clock[1] = (t - clock[0]) - gain
    clock[0] = t


@njit()
def _run(
    law: Law,
    motion: Motion,
    clock: npt.NDArray[np.float64],
    duration: float,
    out: npt.NDArray[np.float64],
    method: int | None,
    dt: float,
    locates: bool,
) -> int:
    # Fills rows of `out` until it is full, the time is over, or nothing more can happen. Returns rows. clock: `count`.
    rows = 0
    while rows < out.shape[0] and clock[0] < duration and motion.outcome == exact.MOVING:
        event, moved = _next(law, motion, duration - clock[0], method, dt, locates)
        count(clock, moved)
        if has_left_head(motion, event):
            fill(law, motion, clock[0], clock[1], out[rows])
            rows += 1
    return rows


class TooLong(ValueError):
    """More contacts than were allowed; says after how many seconds.

    >>> import drumstick as ds
    >>> ds.simulate(ds.scene("roll"), 1e6, most_contacts=2000)
    Traceback (most recent call last):
        ...
    drumstick.stick.simulate.TooLong: more than 2000 contacts in the first ... s
    """


def simulate(
    scene: Scene,
    duration_s: float,
    v0_m_per_s: float = 0.4,
    stepper: Stepper | None = None,
    most_contacts: float = math.inf,
) -> Run:
    """Play the scene's stick for `duration_s` from z = 0+, upward at `v0_m_per_s`; by `exact` without a stepper.

    Raises TooLong when more than `most_contacts` would have to be kept, give or take a thousand.
    """
    law = law_of(scene)
    motion = thrown(scene, v0_m_per_s)
    blocks: list[npt.NDArray[np.float64]] = []
    clock = np.zeros(2)
    method = STEPPERS[stepper.name] if stepper else None
    dt, locates = (stepper.dt_s, stepper.locates) if stepper else (math.inf, True)
    while True:
        out = np.zeros((_BLOCK, len(COLUMNS)))
        rows = _run(law[0], motion[0], clock, duration_s, out, method, dt, locates)
        blocks.append(out[:rows])
        if rows < _BLOCK:
            break
        if len(blocks) * _BLOCK > most_contacts:
            raise TooLong(f"more than {most_contacts:g} contacts in the first {float(clock[0]):.6g} s")
    return Run(np.concatenate(blocks), ENDS[int(motion["outcome"][0])], float(clock[0]))
