"""The pulse that makes one-handed rolls: h(t) = sign (m dv / tau) exp(-t / tau), equation (4).

`trigger` says when it fires (the paper's text: entry), `sign` which way (+1 is up, away from the head),
`overlap` what a new one does to one still going on. Its push is kept as an acceleration, h/m, so a change of
m above the head leaves the speed it still has to give unchanged. Kernels: tick thread; no allocation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from drumstick.declare import choice, number
from realtime.jit import ArgumentType, Record, njit, overload, record_has

ENTRY, TURN, EXIT = 0, 1, 2
ADD, REPLACE, IGNORE = 0, 1, 2
DELIVERED_AFTER_TAUS = 5.0  # for overlap = "ignore": by then 99.3 % of dv has been given
SPENT_M_PER_S = 1e-25  # a tail that can still give less than this is set to 0, before it becomes denormal


@dataclass(frozen=True)
class Pulse:
    """`[effects.pulse]`."""

    dv_m_per_s: float = number(
        0.2, 0.0, 10.0, "m/s", "Speed that one pulse adds: higher is a louder, slower roll",
        symbol="Δv_pls", equation="(4)", wire="dv_pls",
    )  # fmt: skip
    tau_s: float = number(
        0.002, 1e-6, 1.0, "s", "How long the pulse lasts",
        symbol="τ", equation="(4)", wire="tau", scale="log",
    )  # fmt: skip
    trigger: Literal["entry", "turn", "exit"] = choice(
        "exit", ("entry", "turn", "exit"), "When it fires: at contact, at the deepest point, at release"
    )
    sign: Literal[1, -1] = choice(1, (1, -1), "1 pushes up, away from the head; -1 into it")
    overlap: Literal["add", "replace", "ignore"] = choice(
        "add", ("add", "replace", "ignore"), "What a new pulse does to one that has not faded yet"
    )


# What the pulse remembers between ticks: its push h/m in m/s^2, and the time since it fired in s.
STATE = (("push", "f8"), ("age", "f8"))


def fire(law: Record, motion: Record, when: int) -> None:
    """Start a pulse if the scene has one that fires `when` (ENTRY, TURN, EXIT)."""


def push(law: Record, motion: Record) -> float:
    """The pulse's acceleration now, m/s^2; 0 without a pulse."""
    raise TypeError("compiled code only")


def rate(law: Record) -> float:
    """1/tau in 1/s; 0 without a pulse."""
    raise TypeError("compiled code only")


def elapse(law: Record, motion: Record, push_now: float, duration: float) -> None:
    """Store the push after `duration` seconds of closed-form motion."""


def keep_speed(law: Record, new_law: Record, motion: Record) -> None:
    """Before `new_law` takes over: what a running pulse still has to give, push times tau, stays as it is."""


def left(law: Record, motion: Record) -> float:
    """The speed, m/s, that a running pulse still has to give; 0 without one."""
    raise TypeError("compiled code only")


def stop(law: Record, motion: Record) -> None:
    """End a running pulse at once."""


@njit()
def _fire(law: Record, motion: Record, when: int) -> None:
    if law.pulse.trigger != when:
        return
    still_giving = motion.pulse.age < DELIVERED_AFTER_TAUS * law.pulse.tau and motion.pulse.push != 0.0
    if law.pulse.overlap == IGNORE and still_giving:
        return
    kick = law.pulse.sign * law.pulse.dv_pls / law.pulse.tau
    if law.pulse.overlap == ADD:
        kick += motion.pulse.push
    motion.pulse.push = kick
    motion.pulse.age = 0.0


@njit()
def _elapse(law: Record, motion: Record, push_now: float, duration: float) -> None:
    motion.pulse.push = 0.0 if abs(push_now) * law.pulse.tau < SPENT_M_PER_S else push_now
    motion.pulse.age += duration


@njit()
def _keep_speed(law: Record, new_law: Record, motion: Record) -> None:
    motion.pulse.push *= law.pulse.tau / new_law.pulse.tau


@njit()
def _stop(motion: Record) -> None:
    motion.pulse.push = 0.0


@overload(fire)
def _fire_if_named(
    law: ArgumentType, motion: ArgumentType, when: ArgumentType
) -> Callable[[Record, Record, int], None]:
    if record_has(law, "pulse"):
        return lambda law, motion, when: _fire(law, motion, when)
    return lambda law, motion, when: None


@overload(push)
def _push_if_named(law: ArgumentType, motion: ArgumentType) -> Callable[[Record, Record], float]:
    if record_has(law, "pulse"):
        return lambda law, motion: motion.pulse.push
    return lambda law, motion: 0.0


@overload(rate)
def _rate_if_named(law: ArgumentType) -> Callable[[Record], float]:
    if record_has(law, "pulse"):
        return lambda law: 1.0 / law.pulse.tau
    return lambda law: 0.0


@overload(elapse)
def _elapse_if_named(
    law: ArgumentType, motion: ArgumentType, push_now: ArgumentType, duration: ArgumentType
) -> Callable[[Record, Record, float, float], None]:
    if record_has(law, "pulse"):
        return lambda law, motion, push_now, duration: _elapse(law, motion, push_now, duration)
    return lambda law, motion, push_now, duration: None


@overload(keep_speed)
def _keep_speed_if_named(
    law: ArgumentType, new_law: ArgumentType, motion: ArgumentType
) -> Callable[[Record, Record, Record], None]:
    if record_has(law, "pulse"):
        return lambda law, new_law, motion: _keep_speed(law, new_law, motion)
    return lambda law, new_law, motion: None


@overload(left)
def _left_if_named(law: ArgumentType, motion: ArgumentType) -> Callable[[Record, Record], float]:
    if record_has(law, "pulse"):
        return lambda law, motion: motion.pulse.push * law.pulse.tau
    return lambda law, motion: 0.0


@overload(stop)
def _stop_if_named(law: ArgumentType, motion: ArgumentType) -> Callable[[Record, Record], None]:
    if record_has(law, "pulse"):
        return lambda law, motion: _stop(motion)
    return lambda law, motion: None
