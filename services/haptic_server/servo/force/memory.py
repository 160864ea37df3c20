"""All the memory of one servo, made before its loop starts. Control thread."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.envelope import Limits
from drumstick.safety.fence import Fence, fence_of
from drumstick.stick.hand_path import GESTURE, Gesture
from drumstick.stick.law import thrown
from drumstick.stick.motion import exact
from drumstick.stick.moving_hand import MovingHand
from drumstick.stick.records import Law, Motion
from drumstick.stick.strike_curve import CurveTable, curve_of
from haptic_server import contacts
from haptic_server.block import Block
from haptic_server.block_header import HELD
from haptic_server.limits import lead_s, limits_of
from haptic_server.records import (
    EVENT,
    FAULT_WORDS,
    NO_FAULT,
    PLAN,
    READING,
    STATUS,
    TICK_STATE,
    ContactEvent,
    Plan,
    Reading,
    Status,
    TickState,
    set_type,
)
from haptic_server.servo.force.guard import DEVICE_LIMITS, GUARD, DeviceLimits, GuardState, rebound_bounds
from haptic_server.servo.force.hand_estimate import HandEstimate, new_hand
from haptic_server.servo.force.velocity import Track, new_track
from haptic_server.servo.simulation.phantom import Plant
from haptic_server.servo.simulation.playback import PlaybackState
from haptic_server.servo.simulation.pointed_hand import PointedHand
from haptic_server.servo.trace import TICKS, TRACE, Trace
from haptic_server.specification import EXACT_STICK, Specification
from realtime.atomics import peek
from realtime.records import ABSENT, Record, Rows


class Servo(NamedTuple):
    """All the memory a servo thread touches: arrays of one record each. numba takes the whole tuple as one argument.

    plant: the simulated arm, replay: the recording that is replayed; neither for the exact stick and for real
    devices. own: the state of a device that another package gives. gesture: of a hand of its own; pointed: the hand
    that follows a pointer; moving: the exact stick's whose gesture is recorded, gripping: one that holds an arm ever
    more or less firmly, moving_path: of either, shape (n, 4), columns as drumstick.stick.moving_hand.path_of. What is
    absent chooses the code, so that a servo has only its own device's. ahead: a motion in which the contact that begins
    is played to its end, by ahead_law. hand: None for the exact stick, whose hand is its law, else what is known of the
    hand that holds the arm. curve: of levels over speeds. path: shape (n, 2), times s and heights m of a recorded
    gesture, or (n, 4), a recording. scratch: what the envelope's judgement writes to. pending_set: the set that is
    looked at, a copy of our own; pending_words and pending_numbers are its law in the same memory, law_words those of
    `law`. stream: None unless the scene streams its contacts' force.
    """

    block: Block
    law: Rows[Law]
    motion: Rows[Motion]
    ahead: Rows[Motion]
    ahead_law: Rows[Law]
    tick_state: Rows[TickState]
    plan: Rows[Plan]
    curve: Rows[CurveTable]
    event: Rows[ContactEvent]
    status: Rows[Status]
    timespec: npt.NDArray[np.int64]
    reading: Rows[Reading]
    track: Rows[Track]
    guard: Rows[GuardState]
    device_limits: Rows[DeviceLimits]
    gesture: Rows[Gesture]
    path: npt.NDArray[np.float64]
    trace: Rows[Trace]
    fence: Rows[Fence]
    envelope_limits: Rows[Limits]
    scratch: npt.NDArray[np.float64]
    pending_set: npt.NDArray[np.void]
    pending_words: npt.NDArray[np.int64]
    pending_numbers: npt.NDArray[np.float64]
    law_words: npt.NDArray[np.int64]
    stream: contacts.Stream = ABSENT
    hand: Rows[HandEstimate] = ABSENT
    plant: Rows[Plant] = ABSENT
    replay: Rows[PlaybackState] = ABSENT
    pointed: Rows[PointedHand] = ABSENT
    own: Rows[Record] = ABSENT
    moving: Rows[MovingHand] = ABSENT
    gripping: Rows[MovingHand] = ABSENT
    moving_path: npt.NDArray[np.float64] = ABSENT


def _plan(scene: Scene) -> npt.NDArray[np.void]:
    plan = np.zeros(1, PLAN)
    plan["period_ns"] = round(1e9 / scene.servo.rate_Hz)
    plan["throw_m_per_s"] = scene.hand.throw_m_per_s
    plan["rest_s"] = scene.hand.rest_s
    plan["orbit_radius"] = scene.hand.orbit_radius
    plan["orbit_period_s"] = scene.hand.orbit_period_s
    plan["spin_ns"] = scene.servo.spin_us * 1000
    plan["head_z_m"] = scene.device.head_z_m
    plan["reach_m"] = scene.device.reach_m
    plan["lead_s"] = lead_s(scene)
    return plan


def _device_limits(scene: Scene, specification: Specification) -> npt.NDArray[np.void]:
    limits = np.zeros(1, DEVICE_LIMITS)
    limits["max_force_N"] = min(scene.guard.max_force_N, specification.max_force_N)
    limits["max_slew_N_per_s"] = scene.guard.max_slew_N_per_s
    limits["max_speed_m_per_s"] = scene.guard.max_speed_m_per_s
    limits["lowest_m"] = scene.device.head_z_m + scene.guard.lowest_m
    limits["highest_m"] = scene.device.head_z_m + scene.guard.highest_m
    limits["ramp_s"] = scene.guard.ramp_s
    limits["dead_man"] = scene.guard.dead_man == "button"
    limits["resolution_m"] = specification.resolution_m
    limits["delay_ticks"] = scene.device.delay_ticks
    limits["m_kg"] = specification.moving_kg[0]
    limits["head_z_m"] = scene.device.head_z_m
    return limits


def prepare(scene: Scene, block: Block, specification: Specification = EXACT_STICK) -> Servo:
    """Memory for one servo of this scene on such a device, with the parameters that its new block starts from.

    It starts held where the block says so: the servo before it was, by a panic or by a fault, which it still tells. A
    device that is simulated or replayed adds what it moves (`attach_simulation`). A scene that streams gets a contact
    ring of its own, without a file.
    """
    tick_state = np.zeros(1, TICK_STATE)
    tick_state["revision"] = block.live["revision"][0]
    held = peek(block.control, HELD)
    tick_state["fault"] = held - 1 if held - 1 in FAULT_WORDS else NO_FAULT
    tick_state["panicked"] = held != 0 and tick_state["fault"][0] == NO_FAULT
    tick_state["trace_ended"] = tick_state["fault"] != NO_FAULT  # the ticks before it are on file already
    status = np.zeros(1, STATUS)
    status["fault"] = tick_state["fault"]
    law = block.live["law"][:1].copy()
    motion = thrown(scene, scene.hand.throw_m_per_s)
    if held:  # it is not thrown before somebody arms
        motion["v"], motion["outcome"] = 0.0, exact.LEFT
    envelope_limits, scratch = limits_of(scene, specification).record(), envelope.new_scratch()
    judgement = envelope.judge(law[0], envelope_limits[0], scratch)
    accepted = judgement.code == envelope.OK  # only tests play what the envelope refuses
    tick_state["max_entry_speed"] = judgement.max_entry_speed if accepted else scene.guard.max_speed_m_per_s
    is_exact = specification is EXACT_STICK
    guard = np.zeros(1, GUARD)
    guard["max_restitution"], guard["max_added_speed"] = rebound_bounds(law[0])
    pending_set = np.zeros(1, set_type(law.dtype))
    return Servo(
        block=block,
        law=law,
        motion=motion,
        ahead=motion.copy(),
        ahead_law=law if is_exact else law.copy(),
        tick_state=tick_state,
        plan=_plan(scene),
        curve=curve_of(scene.strike),
        event=np.zeros(1, EVENT),
        status=status,
        timespec=np.zeros(2, np.int64),
        reading=np.zeros(1, READING),
        track=new_track(judgement.window) if accepted else new_track(),
        guard=guard,
        device_limits=_device_limits(scene, specification),
        gesture=np.zeros(1, GESTURE),
        path=np.zeros((2, 2)),
        trace=np.zeros(TICKS, TRACE),
        fence=fence_of(scene),
        envelope_limits=envelope_limits,
        scratch=scratch,
        pending_set=pending_set,
        pending_words=pending_set.view(np.int64)[1:],
        pending_numbers=pending_set.view(np.float64)[1:],
        law_words=law.view(np.int64),
        stream=contacts.stream_to(contacts.in_memory()) if scene.drum.excitation == "streamed" else ABSENT,
        hand=ABSENT if is_exact else new_hand(scene),
    )
