"""Independent judge of a sampled arm in a held hand: does it gain energy, does it come to rest, is any limit passed?

The judge sees what a camera and a force gauge at the arm would see: the true position and speed of the simulated arm
and the force that its motors really exert, tick by tick. It knows nothing of the law, the guard or the envelope, and it
grants no exemption: what the motors do in a tick counts, whoever foresaw it.

A steady hammer balances the motors' work with the losses of hand and friction, so a ledger that credits losses sees
nothing. Hence two rules instead.

- Held, no pulse, no throw: the energy at successive contact entries falls until it is below that of 0.01 m/s, and stays
  there; after the given time the arm is at rest.
- Else: the motors' work since the last pulse or throw is at most the energy that was stored then, besides what pulses
  give, m ((v + dv)^2 - v^2)/2.

Virtual time, one thread; no allocation inside the compiled part.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.servo import loop
from haptic_server.servo.force import memory
from haptic_server.servo.force.event_output import publish_status
from haptic_server.servo.simulation.phantom import Plant
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit

SLOW_M_PER_S = 0.01
LAST_S = 0.3  # the end of a run, over which the arm must be still

# What was seen. `entry_J` and `before_J`: energy at the last two contact entries; `grown_J`: the largest growth from
# one entry to the next that ended above the energy of 0.01 m/s; `late_m_per_s`: the fastest in the last 0.3 s.
SEEN: np.dtype[Any] = np.dtype(
    [
        ("entries", "i8"),
        ("before_J", "f8"),
        ("entry_J", "f8"),
        ("grown_J", "f8"),
        ("grown_from_J", "f8"),
        ("grown_at_s", "f8"),
        ("late_entries", "i8"),
        ("late_entry_J", "f8"),
        ("late_m_per_s", "f8"),
        ("fastest_m_per_s", "f8"),
        ("lowest_m", "f8"),
        ("highest_m", "f8"),
        ("force_N", "f8"),
        ("work_J", "f8"),
        ("stored_J", "f8"),
        ("given_J", "f8"),
        ("excess_J", "f8"),
    ],
    align=True,
)


@njit()
def _kinetic(m: float, v: float) -> float:
    return 0.5 * m * v * v


@njit()
def _entry_energy(m: float, z0: float, v0: float, z1: float, v1: float) -> float:
    # At z = 0 between two ticks: under a force that does not change v^2 is linear in z, whether it turned or not.
    share = z0 / (z0 - z1)
    return max(0.5 * m * (v0 * v0 + share * (v1 * v1 - v0 * v0)), 0.0)


@njit()
def _stored(plant: Plant, head_m: float) -> float:
    # Kinetic energy, and what the hand's spring would still give until the arm is at the head.
    spring = 0.5 * plant.k_hand_N_per_m
    off, off_head = plant.z_m - plant.hand_m, head_m - plant.hand_m
    return _kinetic(plant.m_kg, plant.v_m_per_s) + spring * (off * off - off_head * off_head)


@njit()
def _note_entry(seen: Any, energy: float, slow_J: float, t_s: float, is_late: bool) -> None:
    seen.before_J = seen.entry_J
    seen.entry_J = energy
    seen.entries += 1
    if seen.entries > 1 and energy > slow_J:
        grown = energy - seen.before_J
        if grown >= 0.0 and grown > seen.grown_J:
            seen.grown_J = grown
            seen.grown_from_J = seen.before_J
            seen.grown_at_s = t_s
    if is_late:
        seen.late_entries += 1
        seen.late_entry_J = max(seen.late_entry_J, energy)


@njit()
def _step(servo: memory.Servo, eye: Any, now_ns: int, is_late: bool) -> int:
    plant, head_m = servo.plant[0], servo.plan[0].head_z_m
    m = plant.m_kg
    z0, v0 = plant.z_m - head_m, plant.v_m_per_s
    force, hand_m = plant.force_N, plant.hand_m
    now_ns += servo.plan[0].period_ns
    loop.traced_tick(servo, now_ns, servo.plan[0].period_ns * 1e-9)
    servo.status[0].tick += 1
    publish_status(servo, now_ns)
    z1, v1 = plant.z_m - head_m, plant.v_m_per_s
    eye.work_J += force * (z1 - z0)
    eye.excess_J = max(eye.excess_J, eye.work_J - eye.stored_J - eye.given_J)
    eye.force_N = max(eye.force_N, abs(force))
    eye.fastest_m_per_s = max(eye.fastest_m_per_s, abs(v1))
    eye.lowest_m, eye.highest_m = min(eye.lowest_m, z1), max(eye.highest_m, z1)
    if is_late:
        eye.late_m_per_s = max(eye.late_m_per_s, abs(v1))
    if plant.hand_m != hand_m:  # the hand moves, so it may give what it likes: a throw
        eye.entries = 0
        eye.work_J, eye.given_J = 0.0, 0.0
        eye.stored_J = max(_stored(plant, head_m), 0.0)
    elif z0 > 0.0 >= z1:
        slow_J = _kinetic(m, SLOW_M_PER_S)
        _note_entry(eye, _entry_energy(m, z0, v0, z1, v1), slow_J, now_ns * 1e-9, is_late)
    return now_ns


@njit()
def watch(servo: memory.Servo, seen: npt.NDArray[np.void], ticks: int, now_ns: int, is_last: bool) -> int:
    """Run `ticks` ticks as `loop.run_virtual` does, under the judge's eyes; `is_last`: the run's end begins with them.

    Returns the last tick's time.
    """
    servo, eye = borrowed_view(servo), seen[0]
    late_from = ticks - int(LAST_S * 1e9 / servo.plan[0].period_ns) if is_last else ticks
    for tick in range(ticks):
        now_ns = _step(servo, eye, now_ns, tick >= late_from)
    return now_ns


@njit()
def watch_pulses(servo: memory.Servo, seen: npt.NDArray[np.void], ticks: int, now_ns: int) -> int:
    """As `watch`, with the effect `pulse`: each may give m ((v + dv)^2 - v^2)/2 besides what is stored then.

    That one has begun is read from the servo: its push grows.
    """
    servo = borrowed_view(servo)
    eye, plant, motion = seen[0], servo.plant[0], servo.motion[0]
    for _ in range(ticks):
        push = motion.pulse.acceleration
        now_ns = _step(servo, eye, now_ns, False)
        if motion.pulse.acceleration > push:
            dv, v = servo.law[0].pulse.dv_pls, abs(plant.v_m_per_s)
            eye.work_J = 0.0
            eye.stored_J = max(_stored(plant, servo.plan[0].head_z_m), 0.0)
            eye.given_J = 0.5 * plant.m_kg * ((v + dv) * (v + dv) - v * v)
    return now_ns


@njit()
def begin(servo: memory.Servo, seen: npt.NDArray[np.void]) -> None:
    """Start afresh: forget what was seen; what is stored now may be given back."""
    eye = seen[0]
    eye.entries = eye.late_entries = 0
    eye.before_J = eye.entry_J = eye.late_entry_J = eye.late_m_per_s = eye.fastest_m_per_s = 0.0
    eye.grown_J = -1.0
    eye.grown_at_s = eye.grown_from_J = eye.force_N = eye.work_J = eye.given_J = eye.excess_J = 0.0
    eye.lowest_m = eye.highest_m = 0.0
    eye.stored_J = max(_stored(servo.plant[0], servo.plan[0].head_z_m), 0.0)


class Verdict(NamedTuple):
    """Verdict on a held arm without pulses. Speeds m/s of an arm with the energy in question."""

    safe: bool
    entries: int
    grown_from_m_per_s: float
    grown_to_m_per_s: float
    late_entry_m_per_s: float
    late_m_per_s: float
    force_N: float
    fastest_m_per_s: float
    fault: int


def _speed(m: float, energy: float) -> float:
    return float(np.sqrt(2.0 * max(energy, 0.0) / m))


def verdict(servo: memory.Servo, seen: npt.NDArray[np.void]) -> Verdict:
    """The verdict on what was seen of a held arm until now."""
    eye, m = seen[0], float(servo.plant[0]["m_kg"])
    late, late_entry = float(eye["late_m_per_s"]), _speed(m, float(eye["late_entry_J"]))
    grown = float(eye["grown_J"])
    return Verdict(
        safe=grown < 0.0 and late <= SLOW_M_PER_S and late_entry <= SLOW_M_PER_S,
        entries=int(eye["entries"]),
        grown_from_m_per_s=_speed(m, float(eye["grown_from_J"])) if grown >= 0.0 else 0.0,
        grown_to_m_per_s=_speed(m, float(eye["grown_from_J"]) + grown) if grown >= 0.0 else 0.0,
        late_entry_m_per_s=late_entry,
        late_m_per_s=late,
        force_N=float(eye["force_N"]),
        fastest_m_per_s=float(eye["fastest_m_per_s"]),
        fault=int(servo.tick_state[0]["fault"]),
    )


def held(servo: memory.Servo, seconds: float) -> Verdict:
    """Play a held arm for `seconds` of virtual time, and judge it."""
    seen = np.zeros(1, SEEN)
    begin(servo, seen)
    ticks = round(seconds * 1e9 / int(servo.plan[0]["period_ns"]))
    watch(servo, seen, ticks, 0, True)
    return verdict(servo, seen)
