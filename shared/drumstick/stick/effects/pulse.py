"""The pulse that makes one-handed rolls: h(t) = sign (m dv / tau) exp(-t / tau), equation (4).

`trigger` says when it fires (the paper's text: entry), `sign` which way (+1 is up, away from the head),
`overlap` what a new one does to one still going on. Kernels: tick thread; no allocation.
"""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, number
from drumstick.stick.effects import decaying_pulse
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import only_with
from realtime.records import Record


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
        "exit", decaying_pulse.TRIGGERS, "When it fires: at contact, at the deepest point, at release"
    )
    sign: Literal[1, -1] = choice(1, (1, -1), "1 pushes up, away from the head; -1 into it")
    overlap: Literal["add", "replace", "ignore"] = choice(
        "add", decaying_pulse.OVERLAPS, "What a new pulse does to one that has not faded yet"
    )


class PulseLaw(Record):
    """`Pulse` in compiled code: by wire names; a choice is its index."""

    dv_pls: float
    tau: float
    trigger: int
    sign: int
    overlap: int


class _Law(Law):
    pulse: PulseLaw


class _Motion(Motion):
    pulse: decaying_pulse.PulseState


TABLE = Pulse
LAW, STATE = PulseLaw, decaying_pulse.PulseState
STRENGTH = "dv_pls"


@only_with("pulse")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Start a pulse if it fires `when` (drumstick.stick.effects.triggers)."""
    decaying_pulse.fire(law.pulse, motion.pulse, when, law.pulse.dv_pls)


@only_with("pulse", otherwise=())
def pulses(law: _Law, motion: _Motion) -> tuple[tuple[float, float], ...]:
    """The pulse's acceleration now (m/s^2) and the rate at which it fades (1/s)."""
    return ((motion.pulse.acceleration, 1.0 / law.pulse.tau),)


@only_with("pulse", otherwise=0.0)
def remaining_speed(law: _Law, motion: _Motion) -> float:
    """The speed, m/s, that a running pulse still has to give."""
    return motion.pulse.acceleration * law.pulse.tau


@only_with("pulse", otherwise=0.0)
def pending_speed(law: _Law, motion: _Motion) -> float:
    """The speed, m/s, that one gives which the deepest point of the present contact will start."""
    return law.pulse.dv_pls if decaying_pulse.is_pending(law.pulse, motion) else 0.0


@only_with("pulse", otherwise=1.0)
def fade(law: _Law, duration: float) -> float:
    """The share of it that is left after `duration` seconds."""
    return decaying_pulse.fade(law.pulse, duration)


@only_with("pulse")
def elapse(law: _Law, motion: _Motion, duration: float, fade: float) -> None:
    """Let it fade to that share in `duration` seconds."""
    decaying_pulse.elapse(law.pulse, motion.pulse, duration, fade)


@only_with("pulse")
def keep_speed(law: _Law, new_law: _Law, motion: _Motion) -> None:
    """Keep what a running pulse still has to give, push times tau, before `new_law` takes over."""
    motion.pulse.acceleration *= law.pulse.tau / new_law.pulse.tau


@only_with("pulse")
def stop(law: _Law, motion: _Motion) -> None:
    """End a running pulse at once."""
    motion.pulse.acceleration = 0.0


@only_with("pulse", otherwise=0.0)
def max_added_speed(law: _Law) -> float:
    """The most speed, m/s, that it adds to one contact."""
    return law.pulse.dv_pls


@only_with("pulse", otherwise=0.0)
def max_acceleration(law: _Law, soonest: float) -> float:
    """The largest acceleration, m/s^2, of pulses that are at least `soonest` seconds apart."""
    return law.pulse.dv_pls / law.pulse.tau * decaying_pulse.max_overlap(law.pulse, soonest)


@only_with("pulse", otherwise=0.0)
def time_constant(law: _Law) -> float:
    """Its tau, s."""
    return law.pulse.tau


@only_with("pulse", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device. A tau below 0 would make the pulse grow for ever."""
    given = law.pulse
    return 0.0 <= given.dv_pls < 1e3 and 0.0 < given.tau < 1e3 and given.dv_pls / given.tau < 1e12
