"""The records in the block: what the servo tells the gateway, and what it is told."""

from typing import Any

import numpy as np

STRIKE, RELEASE = 1, 2

# One strike or release. A strike tells its speed (m/s, > 0) and foresees the contact, a release tells the speed that it
# was left with and what the contact was.
EVENT: np.dtype[Any] = np.dtype(
    [
        ("kind", "i8"),
        ("seq", "i8"),
        ("t_ns", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("speed_m_per_s", "f8"),
        ("peak_N", "f8"),
        ("contact_s", "f8"),
        ("impulse_N_s", "f8"),
        ("level", "f8"),
    ],
    align=True,
)

READY, PLAYING, PANIC, FAULT = 0, 1, 2, 3
STATUS_WORDS = ("ready", "playing", "panic", "fault")
NO_FAULT, OUT_OF_BOUNDS, NOT_A_NUMBER, UNPLUGGED, STALLED, STALE, TOO_FAST = 0, 1, 2, 3, 4, 5, 6
FORCE_ERROR, WARM, SAFETY_SWITCH, SCHEDULER = 8, 9, 10, 11
DEAD_MAN = 12  # no fault: the button that must be held is not
SELF_DRIVEN = 13
FAULT_WORDS = {
    NO_FAULT: "",
    OUT_OF_BOUNDS: "the stick's motion or its force is not a number, or beyond 1000 m or m/s",
    NOT_A_NUMBER: "the device told a position that is not a number",
    UNPLUGGED: "the device does not answer: look at its cable and power",
    STALLED: "the force loop stood still for more than 20 ms: something else took the processor",
    STALE: "the device has told no new position for 10 ms",
    TOO_FAST: "the stick was moved faster than [guard] max_speed_m_per_s",
    FORCE_ERROR: "the device's own force protection stopped the motors",
    WARM: "the motors are too warm: let them rest",
    SAFETY_SWITCH: "the device's safety switch is open",
    SCHEDULER: "the device's driver ended its servo thread",
    SELF_DRIVEN: "the head kept the stick moving by itself, without a pulse: lower r_in or k_coll",
}

# The servo after each tick. `refused` counts sets that its own fence turned down, `refused_revision` names the last.
STATUS: np.dtype[Any] = np.dtype(
    [
        ("t_ns", "i8"),
        ("tick", "i8"),
        ("status", "i8"),
        ("fault", "i8"),
        ("z_m", "f8"),
        ("v_m_per_s", "f8"),
        ("force_N", "f8"),
        ("x", "f8"),
        ("y", "f8"),
        ("roll_rate_Hz", "f8"),
        ("v_e_m_per_s", "f8"),
        ("strikes", "i8"),
        ("overruns", "i8"),
        ("lateness_worst_ns", "i8"),
        ("revision", "i8"),
        ("refused", "i8"),
        ("refused_revision", "i8"),
    ],
    align=True,
)

# What the simulated player and the tick remember. `phase` walks the strikes over the head; `rest_s` is how long the
# stick has lain dead, `still_s` how long it crept or was out of reach; the last two strike instants make the roll rate.
# `reach`: the fastest entry that keeps all limits, m/s, with the law that plays (envelope.Judgement). `holding`: a set
# that passed waits to be latched, with its own reach and its longest window for the speed. `loss`: the share of its
# push that the head holds back while a slow blow leaves it (drumstick.safety.sampled_contact); `last_v`: the last speed
# but 0.
PLAYER: np.dtype[Any] = np.dtype(
    [
        ("phase", "f8"),
        ("rest_s", "f8"),
        ("still_s", "f8"),
        ("seq", "i8"),
        ("revision", "i8"),
        ("last_ns", "i8"),
        ("before_last_ns", "i8"),
        ("roll_rate_Hz", "f8"),
        ("v_e_m_per_s", "f8"),
        ("x", "f8"),
        ("y", "f8"),
        ("refused", "i8"),
        ("refused_revision", "i8"),
        ("fault", "i8"),
        ("panicked", "i8"),
        ("panics_seen", "i8"),
        ("holding", "i8"),
        ("reach", "f8"),
        ("offer_reach", "f8"),
        ("offer_window", "i8"),
        ("loss", "f8"),
        ("last_v", "f8"),
        ("force_N", "f8"),
        ("traced", "i8"),
        ("trace_ended", "i8"),
    ],
    align=True,
)

# What a device tells once a tick, in the paper's frame: x to the right, y away from the player, z up, from the middle
# of its workspace. `fresh` is 0 when nothing new came; `trouble` is a fault code; temperature is the warmest motor's,
# 0 .. 1.
READING: np.dtype[Any] = np.dtype(
    [
        ("x_m", "f8"),
        ("y_m", "f8"),
        ("z_m", "f8"),
        ("t_ns", "i8"),
        ("buttons", "i8"),
        ("temperature", "f8"),
        ("trouble", "i8"),
        ("fresh", "i8"),
    ],
    align=True,
)

# Where a pointer wants the hand, as the gateway heard it at t_ns of this machine's clock. lift: 0 at z_ss .. 1 lifted.
POINTER: np.dtype[Any] = np.dtype(
    [("t_ns", "i8"), ("held", "i8"), ("lift", "f8"), ("x", "f8"), ("y", "f8")], align=True
)

# What does not change while a servo runs.
PLAN: np.dtype[Any] = np.dtype(
    [
        ("period_ns", "i8"),
        ("throw_m_per_s", "f8"),
        ("rest_s", "f8"),
        ("orbit_radius", "f8"),
        ("orbit_period_s", "f8"),
        ("head_z_m", "f8"),
        ("reach_m", "f8"),
        ("lead_s", "f8"),
        ("spin_ns", "i8"),
    ],
    align=True,
)


def set_type(law: np.dtype[Any]) -> np.dtype[Any]:
    """A whole set of parameters with its revision, as it goes either way through a triple buffer."""
    return np.dtype([("revision", "i8"), ("law", law)], align=True)
