"""An effect and a device for the haptic drumstick."""

import math
from dataclasses import dataclass

import drumstick as ds


@dataclass(frozen=True)
class Sticky:
    """A head that holds the stick back on its way out: `[effects.sticky]` of a scene."""

    force_N: float = ds.number(
        0.2, 0.0, 5.0, "N", "Force by which the head holds the stick back", wire="sticky.force"
    )


class Way(ds.Record):
    """Way of the stick in the head: 1 up, 0 down."""

    up: int


def fire(state, when):
    """Note the way at entry (0), the deepest point (1), exit (2), up again (3), down again (4)."""
    state.up = 1 if when in (1, 3) else 0


def force(own, state):
    """Force on the stick while it is in the head, N."""
    return -own.force * state.up


def max_force(own):
    """Largest force that it can have, N."""
    return own.force


STICKY = ds.Effect(Sticky, force, max_force, fire=fire, state=Way)


class Arm(ds.Record):
    """State of a simulated arm in a hand that moves up and down."""

    t_s: float
    z_m: float
    v_m_per_s: float
    force_N: float


def read(state, reading, span_s):
    """Move on by span_s, and read the encoder."""
    state.t_s += span_s
    hand_m = 0.02 * math.cos(4.0 * math.pi * state.t_s)
    push_N = state.force_N + 60.0 * (hand_m - state.z_m) - 2.0 * state.v_m_per_s
    state.v_m_per_s += span_s * push_N / 0.075
    state.z_m += span_s * state.v_m_per_s
    reading.z_m = 3e-5 * math.floor(state.z_m / 3e-5)
    reading.fresh = 1


def write(state, force_N):
    """Give the motors this force until the next tick."""
    state.force_N = force_N


ARM = ds.Device(
    ds.Specification(
        name="my arm",
        workspace_m=(0.4, 0.2, 0.25),
        resolution_m=3e-5,
        max_force_N=8.5,
        continuous_force_N=1.4,
        stiffness_N_per_m=3500.0,
        damping_N_s_per_m=math.inf,
        rates_Hz=range(500, 2001),
        moving_kg=(0.064, 0.15),
    ),
    Arm,
    read,
    write,
)
