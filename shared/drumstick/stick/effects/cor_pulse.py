"""The direct alteration of the coefficient of restitution (section 4.1): a pulse as strong as the blow was fast.

Each contact gets a pulse of gamma |v_in|, so that v_{i+1} = alpha (beta + gamma) v_i, equation (8). With a
constant alpha that decays or grows without end; with the real alpha(v) it can settle at an upper speed.

`scale` "speed": the push gives gamma |v_in|. "speed_over_beta": gamma |v_in|/beta with beta by (3), the paper's own
dv = -gamma z'(t_in)/beta. At entry, into the drum, and over before the head gives way, it makes the restitution
beta + gamma, for the head gives back beta times as much of it. Kernels: tick thread; no allocation.
"""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, number
from drumstick.stick.contact import beta_eq3
from drumstick.stick.effects import decaying_pulse
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import only_with
from realtime.records import Record

SCALES = ("speed", "speed_over_beta")
_OVER_BETA = SCALES.index("speed_over_beta")
ALSO_NEEDED = (
    'scale = "speed_over_beta" needs a beta by (3): r_in^2 below 4 m k_coll, and gamma/beta below 1000'
)


@dataclass(frozen=True)
class CorPulse:
    """`[effects.cor_pulse]`."""

    gamma: float = number(
        0.2, 0.0, 2.0, "1", "What is added to the coefficient of restitution",
        symbol="γ", equation="(8)", wire="gamma",
    )  # fmt: skip
    tau_s: float = number(
        0.002, 1e-6, 1.0, "s", "How long the added push lasts",
        symbol="τ", equation="(4)", wire="tau", scale="log",
    )  # fmt: skip
    trigger: Literal["entry", "turn", "exit"] = choice(
        "exit", decaying_pulse.TRIGGERS, "When it fires: at contact, at the deepest point, at release"
    )
    sign: Literal[1, -1] = choice(1, (1, -1), "1 pushes up, away from the head; -1 into it")
    overlap: Literal["add", "replace", "ignore"] = choice(
        "add", decaying_pulse.OVERLAPS, "What a new push does to one that has not faded yet"
    )
    scale: Literal["speed", "speed_over_beta"] = choice(
        "speed",
        SCALES,
        "What gamma multiplies: the blow's speed, or that over beta by (3), as the paper has it",
    )


class CorPulseLaw(Record):
    """`CorPulse` in compiled code: by wire names; a choice is its index."""

    gamma: float
    tau: float
    trigger: int
    sign: int
    overlap: int
    scale: int


class _Law(Law):
    cor_pulse: CorPulseLaw


class _Motion(Motion):
    cor_pulse: decaying_pulse.PulseState


TABLE = CorPulse
LAW, STATE = CorPulseLaw, decaying_pulse.PulseState
STRENGTH = "gamma"


@only_with("cor_pulse", otherwise=0.0)
def speed_factor(law: _Law) -> float:
    """The speed that a push gives over that of its blow; 0 where (3) has no beta to divide by."""
    given = law.cor_pulse
    if given.scale != _OVER_BETA:
        return given.gamma
    beta = beta_eq3(law.m, law.k_coll, law.r_in)
    return given.gamma / beta if beta > 0.0 else 0.0


@only_with("cor_pulse")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Start a push if it fires `when` (drumstick.stick.effects.triggers)."""
    decaying_pulse.fire(law.cor_pulse, motion.cor_pulse, when, speed_factor(law) * abs(motion.v_in))


@only_with("cor_pulse", otherwise=())
def pulses(law: _Law, motion: _Motion) -> tuple[tuple[float, float], ...]:
    """The push now (m/s^2) and the rate at which it fades (1/s)."""
    return ((motion.cor_pulse.acceleration, 1.0 / law.cor_pulse.tau),)


@only_with("cor_pulse", otherwise=0.0)
def remaining_speed(law: _Law, motion: _Motion) -> float:
    """The speed, m/s, that a running push still has to give."""
    return motion.cor_pulse.acceleration * law.cor_pulse.tau


@only_with("cor_pulse", otherwise=0.0)
def pending_speed(law: _Law, motion: _Motion) -> float:
    """The speed, m/s, that one gives which the deepest point of the present contact will start."""
    return speed_factor(law) * abs(motion.v_in) if decaying_pulse.is_pending(law.cor_pulse, motion) else 0.0


@only_with("cor_pulse", otherwise=1.0)
def fade(law: _Law, duration: float) -> float:
    """The share of it that is left after `duration` seconds."""
    return decaying_pulse.fade(law.cor_pulse, duration)


@only_with("cor_pulse")
def elapse(law: _Law, motion: _Motion, duration: float, fade: float) -> None:
    """Let it fade to that share in `duration` seconds."""
    decaying_pulse.elapse(law.cor_pulse, motion.cor_pulse, duration, fade)


@only_with("cor_pulse")
def keep_speed(law: _Law, new_law: _Law, motion: _Motion) -> None:
    """Keep what a running push still has to give, before `new_law` takes over."""
    motion.cor_pulse.acceleration *= law.cor_pulse.tau / new_law.cor_pulse.tau


@only_with("cor_pulse")
def stop(law: _Law, motion: _Motion) -> None:
    """End a running push at once."""
    motion.cor_pulse.acceleration = 0.0


@only_with("cor_pulse", otherwise=0.0)
def max_speed_factor(law: _Law) -> float:
    """The most by which it raises the coefficient of restitution: all of its push, with nothing lost in the head."""
    return speed_factor(law)


@only_with("cor_pulse", otherwise=0.0)
def max_acceleration_per_speed(law: _Law, soonest: float) -> float:
    """The largest acceleration, m/s^2 per m/s of the blow, of pushes that are at least `soonest` seconds apart."""
    return speed_factor(law) / law.cor_pulse.tau * decaying_pulse.max_overlap(law.cor_pulse, soonest)


@only_with("cor_pulse", otherwise=0.0)
def time_constant(law: _Law) -> float:
    """Its tau, s."""
    return law.cor_pulse.tau


@only_with("cor_pulse", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device."""
    given = law.cor_pulse
    beta = beta_eq3(law.m, law.k_coll, law.r_in) if given.scale == _OVER_BETA else 1.0
    most = min(1e3, 1e12 * given.tau) * beta
    return 0.0 <= given.gamma < most and 0.0 < given.tau < 1e3
