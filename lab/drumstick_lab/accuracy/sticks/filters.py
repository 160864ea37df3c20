"""Estimates of the speed from positions that come in counts: the servo's own, and plain ones to compare it with.

The servo has one, a window as long as a straight line explains the positions (haptic_server.servo.force.velocity); it
is called here as it stands. Fixed windows and a low-pass of the plain difference exist in this file only. Besides: a
simulated arm that falls on the rendered head, with the plant, the law and the guard of the servo itself. Any thread; no
allocation in the kernels, which stand in one file: the kernel cache does not see an edit of another file of `rig`.
"""

import math

import numpy as np
import numpy.typing as npt

from drumstick.stick.motion.events import ABOVE
from haptic_server.servo.force import guard
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import detect_events, requested_forces
from haptic_server.servo.force.velocity import LONGEST, Track, follow, forget, new_track
from haptic_server.servo.simulation import phantom
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

Samples = npt.NDArray[np.float64]

ADAPTIVE = "adaptive window"  # the servo's own
FIXED_TICKS = {"difference": 1, "window of 4": 4, f"window of {LONGEST - 1}": LONGEST - 1}
CUTOFFS_Hz = {"low-pass 100 Hz": 100.0, "low-pass 20 Hz": 20.0}
FILTERS = (ADAPTIVE, *FIXED_TICKS, *CUTOFFS_Hz)


class Filter(Record):
    """One of FILTERS."""

    ticks: int  # length of a fixed window, 0 for the servo's own
    share: float  # what a low-pass takes of each new difference, else 1


FILTER = dtype_of(Filter)

_FROM_M = 0.02
_CLEAR_M = 0.004
_MAX_TICKS = 40_000


def filter_of(name: str, period_s: float) -> npt.NDArray[np.void]:
    """One of FILTERS for positions that come every `period_s` seconds, shape (1,). Raises KeyError for another name."""
    found = np.zeros(1, FILTER)
    found["share"] = 1.0
    if name in CUTOFFS_Hz:
        found["ticks"] = FIXED_TICKS["difference"]
        found["share"] = 1.0 - math.exp(-2.0 * math.pi * CUTOFFS_Hz[name] * period_s)
    elif name != ADAPTIVE:
        found["ticks"] = FIXED_TICKS[name]
    return found


@njit()
def estimate(kind: Filter, track: Track, t_s: float, z_m: float, slack_m: float) -> float:
    """Add a position; returns the speed in m/s by the filter `kind`. Else as
    haptic_server.servo.force.velocity.follow."""
    if kind.ticks == 0:
        return follow(track, t_s, z_m, slack_m)
    newest = (track.newest + 1) % LONGEST
    back = min(track.known, kind.ticks)
    difference = 0.0
    if back > 0:
        at = (newest - back) % LONGEST
        difference = (z_m - track.z_m[at]) / (t_s - track.t_s[at])
    track.newest = newest
    track.z_m[newest] = z_m
    track.t_s[newest] = t_s
    track.known = min(track.known + 1, LONGEST)
    track.v_m_per_s = kind.share * difference + (1.0 - kind.share) * track.v_m_per_s
    return track.v_m_per_s


@njit()
def _estimate(
    kind: Filter, track: Track, z_m: Samples, period_s: float, slack_m: float, out: Samples
) -> None:
    for i in range(len(z_m)):
        out[i] = estimate(kind, track, i * period_s, z_m[i], slack_m)


def estimated_speeds(
    name: str, z_m: Samples, period_s: float, slack_m: float, out: Samples | None = None
) -> Samples:
    """The speeds (m/s) that a filter tells of positions z (m) a period apart, shape as z; into `out` if given."""
    speeds = np.empty_like(z_m) if out is None else out
    _estimate(filter_of(name, period_s)[0], new_track()[0], z_m, period_s, slack_m, speeds)
    return speeds


@njit()
def fall(servo: Servo, kind: Filter, speed: float, phase: float, guarded: bool) -> float:
    """Fall at `speed` m/s from 20 mm, `phase` (0..1) of a tick late; returns the rebound's speed over it.

    Negative when the arm does not come back within 40,000 ticks. servo: of a scene with the plant `phantom`; a hand or
    friction would take part. guarded: with the guard's passivity control.
    """
    servo = borrowed_view(servo)
    plant, motion, plan, held = servo.plant[0], servo.motion[0], servo.plan[0], servo.guard[0]
    period_s = plan.period_ns * 1e-9
    forget(servo.track[0])
    guard.release_force(held)
    held.seen_above = 1
    held.gain = 1.0
    motion.contact_phase = ABOVE
    motion.v = -speed
    plant.z_m = plan.head_z_m + _FROM_M + phase * speed * period_s
    plant.v_m_per_s = -speed
    plant.force_N = 0.0
    for tick in range(1, _MAX_TICKS):
        phantom.move_on(plant, period_s)
        phantom.measure(plant, servo.reading[0], tick * plan.period_ns)
        z = servo.reading[0].z_m - plan.head_z_m
        v = estimate(kind, servo.track[0], tick * period_s, z, servo.device_limits[0].resolution_m)
        detect_events(servo, z, v, tick * plan.period_ns)
        head_N, pulse_N = requested_forces(servo, period_s)
        if guarded:
            phantom.apply_force(
                plant, guard.limit(held, servo.device_limits[0], head_N, pulse_N, z, v, period_s)
            )
        else:
            phantom.apply_force(plant, head_N + pulse_N)
        if plant.z_m > plan.head_z_m + _CLEAR_M and plant.v_m_per_s > 0.0:
            return plant.v_m_per_s / speed
    return -1.0
