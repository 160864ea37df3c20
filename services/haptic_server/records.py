"""Records of the servo: contact events and status, which cross the block to the gateway; tick state, device reading,
pointer and constants."""

from typing import Any

import numpy as np

from realtime.records import Record, dtype_of

STRIKE, RELEASE = 1, 2


class ContactEvent(Record):
    """One strike or release. A strike tells its speed (m/s, > 0) and foresees the contact, a release tells the speed
    that it was left with and what the contact was.
    """

    kind: int
    seq: int
    t_ns: int
    x: float
    y: float
    speed_m_per_s: float
    peak_N: float
    contact_s: float
    impulse_N_s: float
    level: float


EVENT = dtype_of(ContactEvent)

READY, PLAYING, PANIC, FAULT = 0, 1, 2, 3
STATUS_WORDS = ("ready", "playing", "panic", "fault")
NO_FAULT, OUT_OF_BOUNDS, NOT_A_NUMBER, UNPLUGGED, STALLED, STALE, TOO_FAST = 0, 1, 2, 3, 4, 5, 6
FORCE_ERROR, WARM, SAFETY_SWITCH, SCHEDULER = 8, 9, 10, 11
DEAD_MAN = 12  # no fault: the button that must be held is not
SELF_DRIVEN = 13
STALL_FAULT_S = 0.020  # a longer gap between ticks is a latched fault
STALE_S = 0.010  # so is a device without a new position for so long
FAULT_WORDS = {
    NO_FAULT: "",
    OUT_OF_BOUNDS: "the stick's motion or its force is not a number, or beyond 1000 m or m/s",
    NOT_A_NUMBER: "the device gave a position that is not a number",
    UNPLUGGED: "the device does not answer: look at its cable and power",
    STALLED: f"the force loop stood still for more than {STALL_FAULT_S * 1e3:g} ms: something else took the processor",
    STALE: f"the device has given no new position for {STALE_S * 1e3:g} ms",
    TOO_FAST: "the stick was moved faster than [guard] max_speed_m_per_s",
    FORCE_ERROR: "the device's own force protection stopped the motors",
    WARM: "the motors are too warm: let them rest",
    SAFETY_SWITCH: "the device's safety switch is open",
    SCHEDULER: "the device's driver ended its servo thread",
    SELF_DRIVEN: "the head fed the stick energy, or held the force at its limit: lower r_in or k_coll",
}


class Status(Record):
    """The servo after each tick. `refused` counts sets that its own fence turned down, `refused_revision` names the
    last.
    """

    t_ns: int
    tick: int
    status: int
    fault: int
    z_m: float
    v_m_per_s: float
    force_N: float
    x: float
    y: float
    roll_rate_Hz: float
    v_e_m_per_s: float
    strikes: int
    overruns: int
    lateness_worst_ns: int
    revision: int
    refused: int
    refused_revision: int


STATUS = dtype_of(Status)


class TickState(Record):
    """State of the simulated player and the tick. `phase` walks the strikes over the head; `rest_s` is how long
    the stick has lain dead, `still_s` how long it crept or was out of reach; the last two strike instants make the
    roll rate. `max_entry_speed`: the highest entry speed, m/s, after which neither speed nor force exceeds its limit,
    with the law that plays (envelope.Judgement). `is_pending`: a set that passed waits to be latched, with its own
    highest entry speed and longest window for the speed. `force_reduction`: the share of its push that the head holds
    back while a slow blow leaves it (drumstick.safety.sampled_contact); `last_nonzero_v`: the last speed but 0.
    """

    phase: float
    rest_s: float
    still_s: float
    seq: int
    revision: int
    last_ns: int
    before_last_ns: int
    roll_rate_Hz: float
    v_e_m_per_s: float
    x: float
    y: float
    refused: int
    refused_revision: int
    fault: int
    panicked: int
    panics_seen: int
    is_pending: int
    max_entry_speed: float
    pending_max_entry_speed: float
    pending_window: int
    force_reduction: float
    last_nonzero_v: float
    force_N: float
    traced: int
    trace_ended: int


TICK_STATE = dtype_of(TickState)


class Reading(Record):
    """Reading of a device at a tick, in the paper's frame: x to the right, y away from the player, z up, from the
    middle of its workspace. `fresh` is 0 when nothing new came; `trouble` is a fault code; temperature is the
    warmest motor's, 0 .. 1.
    """

    x_m: float
    y_m: float
    z_m: float
    t_ns: int
    buttons: int
    temperature: float
    trouble: int
    fresh: int


READING = dtype_of(Reading)


class Pointer(Record):
    """Place where a pointer wants the hand, as the gateway heard it at t_ns of this machine's clock. lift: 0 at z_ss
    .. 1 lifted.
    """

    t_ns: int
    held: int
    lift: float
    x: float
    y: float


POINTER = dtype_of(Pointer)


class Plan(Record):
    """Constants of a running servo."""

    period_ns: int
    throw_m_per_s: float
    rest_s: float
    orbit_radius: float
    orbit_period_s: float
    head_z_m: float
    reach_m: float
    lead_s: float
    spin_ns: int


PLAN = dtype_of(Plan)


def set_type(law: np.dtype[Any]) -> np.dtype[Any]:
    """A whole set of parameters with its revision, as it goes either way through a triple buffer."""
    return np.dtype([("revision", "i8"), ("law", law)], align=True)
