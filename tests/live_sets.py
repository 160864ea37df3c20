"""Servos in virtual time that are offered sets while they play, and a witness that adds up what the motors really do.

The witness knows the simulated arm's true position, which the servo does not, and shares nothing with the guard but the
ramp's gain: it is the judge of the guard's energy account.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes import table as parameters
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import Records, law_of
from haptic_server import block as blocks
from haptic_server.limits import limits_of
from haptic_server.records import set_type
from haptic_server.servo import loop
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from realtime import triple_buffer
from realtime.kernels.jit import njit

PERIOD_NS, T = sampled_arm.PERIOD_NS, 1e-3
RESOLUTION_M, ARM_KG = 3e-5, 0.075

# What the witness has seen: largest |force| and growth of |force| over a tick; forces that are no numbers; the worst
# energy that a contact gave beyond what it may; its own memory after that.
WITNESS: np.dtype[Any] = np.dtype(
    [
        ("force_N", "f8"),
        ("growth_N", "f8"),
        ("no_numbers", "i8"),
        ("contacts", "i8"),
        ("excess_J", "f8"),
        ("given_J", "f8"),
        ("allowed_J", "f8"),
        ("share_N", "f8"),
        ("v_m_per_s", "f8"),
    ],
    align=True,
)


def roll(text: str = "") -> Scene:
    """The default scene on the exact stick."""
    return parse(shipped_text("roll") + text, "roll")


def scene_of(plant: str) -> Scene:
    """The default scene, or set E on a simulated PHANTOM."""
    return roll() if plant == "stick" else sampled_arm.scene()


def servo_of(played: Scene) -> memory.Servo:
    """Its servo, on its own device, in memory of its own."""
    device = Simulated(played)
    block = blocks.in_memory(law_of(played))
    return device.attach_simulation(memory.prepare(played, block, specification=device.info().specification))


def limits_for(played: Scene) -> envelope.Limits:
    """Limits that gateway and servo hold it to."""
    return limits_of(played, Simulated(played).info().specification)


def changed(law: Records, played: Scene, changes: dict[str, float]) -> Records:
    """A law with these values by wire name, whatever they are: no fence looks at them here."""
    table, wanted = parameters.table_of(played), law.copy()
    for name, value in changes.items():
        row = table[name]
        row.part_of(wanted[0])[row.field] = value
    return wanted


def offer(servo: memory.Servo, revision: int, law: Records) -> None:
    """Put a set into the block as a gateway without a fence would."""
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"], wanted["law"] = revision, law
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])


def gateway_takes(law: Records, played: Scene, changes: dict[str, float]) -> bool:
    """The other fence: would the parameters accept these changes to `law`?"""
    try:
        wanted = parameters.with_changes(law, parameters.table_of(played), changes)
        envelope.require(wanted, limits_for(played))
    except Refusal:
        return False
    return True


@njit()
def _look(servo: memory.Servo, seen: Any, force_before: float, rise_m: float, was_in: bool) -> None:
    # After a tick: the head's share of the force, and its work on the arm's true way since entry.
    guard = servo.guard[0]
    law: Any = servo.law[0]  # of a scene with a pulse
    motion: Any = servo.motion[0]
    force, tau = servo.tick_state[0].force_N, law.pulse.tau
    seen.no_numbers += not abs(force) < 1e9
    seen.force_N = max(seen.force_N, abs(force))
    seen.growth_N = max(seen.growth_N, abs(force) - abs(force_before))
    if was_in:
        seen.given_J += seen.share_N * rise_m
        if (
            seen.v_m_per_s <= 0.0
        ):  # a stick that does not rise may be pushed: a tick or two until it is seen to
            pushed = seen.share_N * 2.0 * T
            seen.allowed_J += max(seen.share_N * rise_m, 0.0) if rise_m > 0.0 else 0.0
            if servo.track[0].v_m_per_s > 0.0:
                seen.allowed_J += pushed * pushed / (2.0 * ARM_KG)
        seen.excess_J = max(seen.excess_J, seen.given_J - seen.allowed_J)
    elif motion.contact_phase != 0:
        seen.contacts += 1
        seen.given_J = 0.0
        seen.allowed_J = 0.01 * 0.5 * ARM_KG * motion.v_in * motion.v_in
    left = motion.pulse.acceleration * tau
    seen.share_N = force - guard.gain * law.m * left * math.expm1(T / tau) / T
    seen.v_m_per_s = servo.track[0].v_m_per_s


@njit()
def watched(servo: memory.Servo, seen: npt.NDArray[np.void], ticks: int, now_ns: int) -> int:
    """As `loop.run_virtual` on a sampled arm, under the witness's eyes."""
    for _ in range(ticks):
        before, z, was_in = (
            servo.tick_state[0].force_N,
            servo.plant[0].z_m,
            servo.motion[0].contact_phase != 0,
        )
        now_ns = loop.run_virtual(servo, 1, now_ns)
        _look(servo, seen[0], before, servo.plant[0].z_m - z, was_in)
    return now_ns
