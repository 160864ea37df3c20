"""All the memory of one servo, made before its loop starts. Control thread."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.law import thrown
from drumstick.scene import Scene
from haptic_server import contacts
from haptic_server.block import HELD, Block
from haptic_server.device.hand import GESTURE
from haptic_server.device.specification import EXACT_STICK, Specification
from haptic_server.limits import lag_s, limits_of
from haptic_server.records import EVENT, PLAN, PLAYER, READING, STATUS, set_type
from haptic_server.servo.fence import fence_of
from haptic_server.servo.guard import ALLOWED, GUARD, may_add
from haptic_server.servo.streaming import Stream, stream_to
from haptic_server.servo.trace import TICKS, TRACE
from haptic_server.servo.velocity import TRACK
from realtime.atomics import peek


class Servo(NamedTuple):
    """All the memory a servo thread touches: arrays of one record each. numba takes the whole tuple as one argument.

    plant: None for the exact stick and for real devices, else the record of a simulated arm or of a recording; gesture:
    the hand's, of its own or after a pointer. Their types choose the code, so that a servo has only its own device's.
    path: shape (n, 2), times s and heights m of a recorded gesture, or (n, 4), a recording. offer: the set that is
    looked at, a copy of our own; offer_words and offer_numbers are its law in the same memory. stream: None unless the
    scene streams its contacts' force.
    """

    block: Block
    law: npt.NDArray[np.void]
    motion: npt.NDArray[np.void]
    player: npt.NDArray[np.void]
    plan: npt.NDArray[np.void]
    event: npt.NDArray[np.void]
    status: npt.NDArray[np.void]
    timespec: npt.NDArray[np.int64]
    reading: npt.NDArray[np.void]
    track: npt.NDArray[np.void]
    guard: npt.NDArray[np.void]
    allowed: npt.NDArray[np.void]
    plant: Any
    gesture: npt.NDArray[np.void]
    path: npt.NDArray[np.float64]
    trace: npt.NDArray[np.void]
    fence: npt.NDArray[np.void]
    offer: npt.NDArray[np.void]
    offer_words: npt.NDArray[np.int64]
    offer_numbers: npt.NDArray[np.float64]
    stream: Stream | None = None


def _plan(scene: Scene, specification: Specification) -> npt.NDArray[np.void]:
    plan = np.zeros(1, PLAN)
    plan["period_ns"] = round(1e9 / scene.servo.rate_Hz)
    plan["throw_m_per_s"] = scene.hand.throw_m_per_s
    plan["rest_s"] = scene.hand.rest_s
    plan["orbit_radius"] = scene.hand.orbit_radius
    plan["orbit_period_s"] = scene.hand.orbit_period_s
    plan["full_scale_m_per_s"] = scene.strike.full_scale_m_per_s
    plan["spin_ns"] = scene.servo.spin_us * 1000
    limits = limits_of(scene, specification)
    plan["max_force_N"] = limits.max_force_N
    plan["max_speed_m_per_s"] = limits.max_speed_m_per_s
    plan["stiffness_N_per_m"] = limits.stiffness_N_per_m
    plan["lag_s"] = limits.lag_s
    plan["head_z_m"] = scene.device.head_z_m
    plan["reach_m"] = scene.device.reach_m
    plan["lead_s"] = lag_s(scene) if scene.servo.predictor == "lead" else 0.0
    return plan


def _allowed(scene: Scene, specification: Specification) -> npt.NDArray[np.void]:
    allowed = np.zeros(1, ALLOWED)
    allowed["max_force_N"] = min(scene.guard.max_force_N, specification.max_force_N)
    allowed["max_slew_N_per_s"] = scene.guard.max_slew_N_per_s
    allowed["max_speed_m_per_s"] = scene.guard.max_speed_m_per_s
    allowed["lowest_m"] = scene.device.head_z_m + scene.guard.lowest_m
    allowed["highest_m"] = scene.device.head_z_m + scene.guard.highest_m
    allowed["ramp_s"] = scene.guard.ramp_s
    allowed["dead_man"] = scene.guard.dead_man == "button"
    allowed["resolution_m"] = specification.resolution_m
    allowed["delay_ticks"] = scene.device.delay_ticks
    allowed["m_kg"] = scene.stick.m_kg
    return allowed


def prepare(scene: Scene, block: Block, specification: Specification = EXACT_STICK) -> Servo:
    """Memory for one servo of this scene on such a device, with the parameters that its new block starts from.

    It starts in panic where the block says that it is held: the servo before it was, by a panic or a fault. A device
    that is simulated or replayed adds what it moves (`furnish`). A scene that streams gets a contact ring of its own,
    without a file.
    """
    player = np.zeros(1, PLAYER)
    player["revision"] = block.live["revision"][0]
    player["panicked"] = peek(block.control, HELD)
    law = block.live["law"][:1].copy()
    guard = np.zeros(1, GUARD)
    guard["e"], guard["b"] = may_add(law[0])
    offer = np.zeros(1, set_type(law.dtype))
    return Servo(
        block=block,
        law=law,
        motion=thrown(scene, scene.hand.throw_m_per_s),
        player=player,
        plan=_plan(scene, specification),
        event=np.zeros(1, EVENT),
        status=np.zeros(1, STATUS),
        timespec=np.zeros(2, np.int64),
        reading=np.zeros(1, READING),
        track=np.zeros(1, TRACK),
        guard=guard,
        allowed=_allowed(scene, specification),
        plant=None,
        gesture=np.zeros(1, GESTURE),
        path=np.zeros((2, 2)),
        trace=np.zeros(TICKS, TRACE),
        fence=fence_of(scene),
        offer=offer,
        offer_words=offer.view(np.int64)[1:],
        offer_numbers=offer.view(np.float64)[1:],
        stream=stream_to(contacts.in_memory()) if scene.drum.excitation == "streamed" else None,
    )
