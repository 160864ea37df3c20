"""The limits of the envelope for a scene on its device: one implementation for gateway and servo. Control threads."""

import json
import logging
import math
import os
from pathlib import Path
from typing import Any, cast

from drumstick.parameters.scene import Scene
from drumstick.safety.envelope import Limits
from haptic_server.files import LIMITS
from haptic_server.specification import EXACT_STICK, Specification
from realtime.regular_file import read_text, write_text

MAX_BYTES = 100_000  # of a file that the servo writes for the gateway: some hundred bytes
_log = logging.getLogger("gateway")


def lag_s(scene: Scene) -> float:
    """Mean age of a sampled device's force: half a period and the device's own delay."""
    return (0.5 + scene.device.delay_ticks) / scene.servo.rate_Hz


def lead_s(scene: Scene) -> float:
    """Time by which the law leads the position of a sampled device, s."""
    return lag_s(scene) if scene.servo.predictor == "lead" else 0.0


def limits_of(scene: Scene, specification: Specification) -> Limits:
    """Limits of guard and device, whichever is tighter: a scene never raises a device's limits."""
    if specification is EXACT_STICK:
        return Limits.of(scene)
    return Limits(
        max_force_N=min(scene.guard.max_force_N, specification.max_force_N),
        max_speed_m_per_s=scene.guard.max_speed_m_per_s,
        stiffness_N_per_m=specification.stiffness_N_per_m,
        period_s=1.0 / scene.servo.rate_Hz,
        delay_ticks=scene.device.delay_ticks,
        lead_s=lead_s(scene),
        lightest_kg=specification.moving_kg[0],
        heaviest_kg=specification.moving_kg[1],
        grip_N_per_m=specification.grip_N_per_m,
        resolution_m=specification.resolution_m,
    )


def write(folder: Path, limits: Limits) -> None:
    """Write `limits` for the gateway, which does not know the device. OSError when the folder has no room."""
    finite = {key: value for key, value in vars(limits).items() if math.isfinite(value)}
    beside = folder / f".{LIMITS}.{os.getpid()}"
    write_text(beside, json.dumps(finite))
    beside.replace(folder / LIMITS)  # a gateway that starts meanwhile reads all of it


def read(folder: Path, scene: Scene) -> Limits:
    """Limits that the servo of this folder wrote before it made its block; a number that it left out has no limit.

    Where that cannot be read, what the scene itself allows, with a warning: the servo judges every set again.
    """
    try:
        given = cast(dict[str, Any], json.loads(read_text(folder / LIMITS, MAX_BYTES)))
        limits = Limits(**given)
        limits.record()  # each of them a number
        return limits
    except (OSError, ValueError, TypeError, RecursionError) as error:
        _log.warning("%s: %s; sets are judged by the scene's own limits, and by the servo", LIMITS, error)
        return Limits.of(scene)


def read_object(path: Path) -> dict[str, object]:
    """JSON object that the servo wrote there for `doctor`; the reason where it cannot be read."""
    try:
        found: object = json.loads(read_text(path, MAX_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        return {"unreadable": str(error)[:200]}
    return cast(dict[str, object], found) if isinstance(found, dict) else {"unreadable": "no JSON object"}
