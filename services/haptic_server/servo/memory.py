"""All the memory of one servo, made before its loop starts. Control thread."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.law import thrown
from drumstick.scene import Scene
from haptic_server.block import Block
from haptic_server.records import EVENT, PLAN, PLAYER, STATUS


class Servo(NamedTuple):
    """All the memory a servo thread touches: arrays of one record each. numba takes the whole tuple as one argument."""

    block: Block
    law: npt.NDArray[np.void]
    motion: npt.NDArray[np.void]
    player: npt.NDArray[np.void]
    plan: npt.NDArray[np.void]
    event: npt.NDArray[np.void]
    status: npt.NDArray[np.void]
    timespec: npt.NDArray[np.int64]


def prepare(scene: Scene, block: Block, held: bool = False) -> Servo:
    """Memory for one servo of this scene, with the parameters that its new block starts from.

    `held`: it starts in panic, because the servo before it was held by a panic or a fault.
    """
    plan = np.zeros(1, PLAN)
    plan["period_ns"] = round(1e9 / scene.servo.rate_Hz)
    plan["throw_m_per_s"] = scene.hand.throw_m_per_s
    plan["rest_s"] = scene.hand.rest_s
    plan["orbit_radius"] = scene.hand.orbit_radius
    plan["orbit_period_s"] = scene.hand.orbit_period_s
    plan["full_scale_m_per_s"] = scene.strike.full_scale_m_per_s
    plan["max_force_N"] = scene.guard.max_force_N
    plan["max_speed_m_per_s"] = scene.guard.max_speed_m_per_s
    player = np.zeros(1, PLAYER)
    player["revision"] = block.live["revision"][0]
    player["panicked"] = held
    return Servo(
        block=block,
        law=block.live["law"][:1].copy(),
        motion=thrown(scene, scene.hand.throw_m_per_s),
        player=player,
        plan=plan,
        event=np.zeros(1, EVENT),
        status=np.zeros(1, STATUS),
        timespec=np.zeros(2, np.int64),
    )
