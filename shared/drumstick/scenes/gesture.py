"""The recorded gesture of a scene as text: where the hand holds its spring, and how firmly. Pure; control threads.

Its columns: `t_s` or `t_ns`; `z_m`; `k_hand_N_per_m` and `r_out_N_s_per_m`, the grip. A column that is absent stays as
`[stick]` has it. The scene's own `[stick]` is the firmest and the loosest that a grip may come to: the firmest spring,
the least damping. So the envelope, which judges that, has judged every grip of the file.
"""

import math
from collections.abc import Iterable

import numpy as np

from drumstick.parameters.declare import quantities
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.scenes.recording import Bound, Check, Recording, TrajectoryError, recording_of
from drumstick.scenes.scene_text import SceneError, shipped_gesture
from drumstick.stick.effects.registry import names_with
from drumstick.stick.human import spread
from drumstick.stick.moving_hand import STILL

# Columns of a gesture after t, x and y.
Z, K_HAND, R_OUT = 3, 4, 5
REACTION_S = 0.1  # a person changes a grip within some 100 ms, no sooner
# What the guard limits is the stick: a mass on a spring goes up to twice as fast as the end of its spring.
_OF_THE_STICKS = 0.5
_UNHURRIED = 0.25  # of the speed that the guard allows: the way back is no stroke
_MIN_BACK_S = 0.01
_LOOSEST = 1e-3  # of the firmest: a hand that let go for a moment would have lost the stick


def _nothing_else(row: tuple[float, ...]) -> str:
    return ""


def has_grip(gesture: Recording) -> bool:
    """True when the file moves K_hand or R_out."""
    return not bool(np.isnan(gesture[0, (K_HAND, R_OUT)]).all())


def moves_hand(gesture: Recording) -> bool:
    """True when the file moves the place where the hand holds its spring."""
    return not math.isnan(gesture[0, Z])


def _grips(scene: Scene) -> dict[str, Bound]:
    stick, units = scene.stick, {key: quantity.unit for key, quantity in quantities(Stick).items()}
    limits = {
        "k_hand_N_per_m": (
            _LOOSEST * stick.k_hand_N_per_m,
            stick.k_hand_N_per_m,
            "[stick] k_hand_N_per_m is the firmest grip, a thousandth of it the loosest",
        ),
        "r_out_N_s_per_m": (
            stick.r_out_N_s_per_m,
            max(stick.r_out_N_s_per_m, stick.r_in_N_s_per_m),
            "[stick] r_out_N_s_per_m is the loosest grip, r_in_N_s_per_m the damping in contact",
        ),
    }
    return {name: Bound(low, high, units[name], why) for name, (low, high, why) in limits.items()}


def gesture_of(lines: Iterable[str], source: str, scene: Scene, check: Check = _nothing_else) -> Recording:
    """The gesture in `lines`, shape (n, 6): t (s), x, y, z (m), K_hand (N/m), R_out (N s/m); NaN in an absent column.

    It lies inside what the scene's guard and `[stick]` allow; check: what else a row has to meet. TrajectoryError names
    line, value and limit. The hand may move half as fast as [guard] max_speed_m_per_s. It is played again and again:
    where it ends elsewhere than it began, the hand goes back before it starts anew.
    """
    gaining = [name for name in names_with("end_gain") if name in scene.effects]
    if gaining and scene.hand_moves_stick:
        raise TrajectoryError(
            f"{source}: a hand that moves cannot play [effects.{gaining[0]}]: flights that gain are judged for a hand "
            "that holds still; leave one of them out"
        )
    guard, lowest_m = scene.guard, scene.guard.lowest_m
    if scene.device.plant == "stick":
        lowest_m = max(lowest_m, scene.stick.z_ss_m)
    recording = recording_of(
        lines,
        source,
        lowest_m,
        guard.highest_m,
        _OF_THE_STICKS * guard.max_speed_m_per_s,
        _grips(scene),
        check,
    )
    first, last = recording[0], recording[-1]
    back_s = 0.0
    if moves_hand(recording) and first[Z] != last[Z]:
        apart_m = abs(float(last[Z] - first[Z]))
        back_s = max(apart_m / (_UNHURRIED * guard.max_speed_m_per_s), _MIN_BACK_S)
    if not np.array_equal(first[K_HAND:], last[K_HAND:], equal_nan=True):
        back_s = max(back_s, REACTION_S)
    if back_s == 0.0:
        return recording
    back = first.copy()
    back[0] = last[0] + back_s
    return np.vstack([recording, back])


def gesture_text(scene: Scene, given: str | None) -> str | None:
    """The CSV text of the scene's recorded gesture: as given, else as shipped; None for a scene without one.

    Raises SceneError for a file that is not shipped and was not given.
    """
    name = scene.hand.gesture_file
    if given is not None or not name:
        return given
    try:
        return shipped_gesture(name)
    except FileNotFoundError:
        raise SceneError(
            [f"{scene.name}: hand.gesture_file: {name} is not a shipped one: give its text as gesture"]
        ) from None


def stick_gesture(scene: Scene, given: str | None) -> Recording | None:
    """The gesture that the scene's exact stick is played with; None where its hand holds still.

    given: see `gesture_text`. Raises SceneError, also for a gesture that is not good.
    """
    if not scene.hand_moves_stick:
        return None
    text = gesture_text(scene, given)
    try:
        return gesture_of((text or "").splitlines(keepends=True), scene.hand.gesture_file, scene)
    except TrajectoryError as error:
        raise SceneError([f"{scene.name}: hand.gesture_file: {error}"]) from None


def played_gesture(scene: Scene, given: str | None) -> Recording | None:
    """The gesture of `stick_gesture`; one that moves nothing where a hand that is no machine ([hand.human]) plays.

    Raises SceneError too where that cannot play the scene.
    """
    if scene.hand.human is None:
        return stick_gesture(scene, given)
    try:
        spread.hand_of(scene)
    except spread.NoSuchSpread as error:
        raise SceneError([f"{scene.name}: hand.human: {error}"]) from None
    return STILL
