"""Writes docs/safety.md; its numbers are read from the code: drumstick lab safety-page.

The words are in safety.template.md. Every test that the page names must exist under its name.
"""

import re
from pathlib import Path

from drumstick.parameters import rig
from drumstick_lab.checkout import DOCS
from drumstick_lab.pages.safety_limits import SCENE, always, before
from drumstick_lab.pages.safety_pressure import (
    BALL_M,
    BARE_TIP_MM2,
    FACE,
    FACE_BALL_M,
    FACE_BODY,
    FACE_N,
    FIRST_FORCE_N,
    HAND,
    HAND_BODY,
    HAND_N,
    OLDER_FACE,
    OLDER_HAND,
    PEAK_OVER_MEAN,
    TRANSIENT,
    body_limits,
    depth_m,
    impact_force,
    least_radius_m,
    radii,
)
from haptic_server.servo.device.openhaptics import freshness
from haptic_server.servo.trace import TICKS
from haptic_server.specification import PREMIUM_1_5

PAGE = DOCS / "safety.md"
TEMPLATE = Path(__file__).parent / "safety.template.md"


def _values() -> dict[str, str]:
    force, speed = SCENE.guard.max_force_N, SCENE.guard.max_speed_m_per_s
    hand, face = min(p.pressure for p in HAND), min(p.pressure for p in FACE)
    light, heavy = PREMIUM_1_5.moving_kg
    on_face = least_radius_m(force, OLDER_FACE, PEAK_OVER_MEAN)
    return {
        "before": before(),
        "always": always(),
        "limits": body_limits(),
        "radii": radii(),
        "force": f"{force:g}",
        "speed": f"{speed:g}",
        "bare": f"{force / (BARE_TIP_MM2 * 1e-2):g}",
        "hand": f"{hand:g}",
        "face": f"{face:g}",
        "bare_times": f"{force / (BARE_TIP_MM2 * 1e-2) / hand:.1f}",
        "hand_mm": f"{least_radius_m(force, hand) * 1e3:.1f}",
        "ball": f"{BALL_M * 1e3:g}",
        "ball_depth": f"{depth_m(BALL_M, least_radius_m(force, face, PEAK_OVER_MEAN)) * 1e3:.1f}",
        "face_ball": f"{FACE_BALL_M * 1e3:g}",
        "face_depth": f"{depth_m(FACE_BALL_M, on_face) * 1e3:.1f}",
        "default_force": f"{rig.Guard().max_force_N:g}",
        "default_speed": f"{rig.Guard().max_speed_m_per_s:g}",
        "light": f"{light * 1e3:g}",
        "heavy": f"{heavy * 1e3:g}",
        "grip": f"{PREMIUM_1_5.grip_N_per_m:g}",
        "energy": f"{0.5 * heavy * speed**2 * 1e3:.0f}",
        "hit_hand": f"{impact_force(speed, heavy, HAND_BODY):.0f}",
        "hit_face": f"{impact_force(speed, heavy, FACE_BODY):.0f}",
        "hand_transient": f"{HAND_N * TRANSIENT:g}",
        "face_force": f"{FACE_N:g}",
        "continuous": f"{PREMIUM_1_5.continuous_force_N:g}",
        "moving": f"{freshness.MOVING_M_PER_S:g}",
        "pressing": f"{freshness.PRESSING_N:g}",
        "peak": f"{PEAK_OVER_MEAN:g}",
        "older_hand": f"{OLDER_HAND:g}",
        "older_face": f"{OLDER_FACE:g}",
        "hand_kPa": f"{hand * 10.0:g}",
        "ticks": f"{TICKS}",
        "first": f"{FIRST_FORCE_N:g}",
    }


def page() -> str:
    """The whole page."""
    words = TEMPLATE.read_text(encoding="utf-8")
    for name, value in _values().items():
        words = words.replace(f"{{{name}}}", value)
    left = re.findall(r"\{\w+\}", words)
    if left:
        raise LookupError(f"the template asks for {', '.join(left)}, which nobody computes")
    return words


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
