"""Sticks in hands that move, offline: one, or two on one head, half a gesture apart. Nothing throws them but the hands.

The hand's spring stands still over each tick of [servo] rate_Hz, and steps to where its path is at the next, as a hand
that follows a pointer does: between steps the motion is exact. A step from z_1 to z_2 gives the spring
K_hand ((z_2 - z)^2 - (z_1 - z)^2)/2: the hand's work. The sticks do not touch each other, and to each the head is a
spring and a damper at rest, whatever else plays on it: their contacts are merged. Any thread; blocks while it computes.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick import simulate
from drumstick.stick.hand_path import GESTURE, GESTURES, Gesture, hand_at
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

Numbers = npt.NDArray[np.float64]

MOST_CONTACTS = 1_000_000  # of each stick
MOST_S = 3600.0  # some tens of megabytes of work_J
_NO_PATH = np.zeros((2, 2))


class Hands(NamedTuple):
    """contacts: shape (n, 8), columns as drumstick.stick.simulate.COLUMNS, by the time at which they begin; hand: shape
    (n,), whose each is. work_J: shape (hands, ticks + 1), what each hand has given its spring by each tick of tick_s.
    """

    contacts: Numbers
    hand: npt.NDArray[np.int64]
    work_J: Numbers
    tick_s: float


def path_of(scene: Scene, rest_m: float) -> npt.NDArray[np.void]:
    """The path of the scene's `[hand]`, which presses at `rest_m`, shape (1,)."""
    found = np.zeros(1, GESTURE)
    found["kind"] = GESTURES.index(scene.hand.gesture)
    found["rest_m"] = rest_m
    found["height_m"] = scene.hand.gesture_height_m
    found["period_s"] = scene.hand.gesture_period_s
    return found


@njit()
def _step_hand(law: Law, motion: Motion, to_m: float) -> float:
    # The work, J, of a hand that steps there.
    before, after = law.z_ss - motion.z, to_m - motion.z
    law.z_ss = to_m
    return 0.5 * law.k_hand * (after * after - before * before)


@njit()
def _has_died_away(motion: Motion, event: int) -> bool:
    # On the head, at a hand that holds its spring right there: no blow any more.
    return motion.outcome == exact.CAPTURED and event in (exact.ENTRY, exact.RELEASE)


@njit()
def _carry(
    law: Law,
    motion: Motion,
    path: Gesture,
    none: Numbers,
    late_s: float,
    tick_s: float,
    out: Numbers,
    work: Numbers,
) -> int:
    # Fills rows of `out`, columns as simulate.COLUMNS, and `work`, one number a tick. Returns the rows, or one more
    # than there is room for.
    rows, lies = 0, False
    for tick in range(work.shape[0] - 1):
        begin, before_m = tick * tick_s, law.z_ss
        work[tick + 1] = work[tick] + _step_hand(law, motion, hand_at(path, none, max(begin - late_s, 0.0)))
        if lies and law.z_ss == before_m:
            continue
        motion.outcome, lies = exact.MOVING, False  # a hand that moves can always lift it
        moved = 0.0
        while moved < tick_s:
            event, duration = exact.advance(law, motion, tick_s - moved)
            moved += duration
            if _has_died_away(motion, event):
                lies, motion.contact_phase, motion.v = True, exact.ABOVE, 0.0
                break
            if event == exact.RELEASE:
                if rows == out.shape[0]:
                    return rows + 1
                simulate.fill(law, motion, begin + moved, 0.0, out[rows])
                rows += 1
            motion.outcome = exact.MOVING
            if event == exact.HORIZON:
                break
    return rows


def play(scene: Scene, duration_s: float, most_contacts: float = MOST_CONTACTS) -> Hands:
    """Play the scene's `[hand] hands` for `duration_s`, each with a stick of its own, the second half a period late.

    Each stick begins at rest in its lifted hand. Raises TooLong for more than an hour, and where one makes more
    contacts than were allowed.
    """
    if duration_s > MOST_S:
        raise simulate.TooLong(f"hands that move are played for {MOST_S:g} s at most")
    tick_s = 1.0 / scene.servo.rate_Hz
    most = int(min(most_contacts, MOST_CONTACTS))
    ticks, hands = round(duration_s / tick_s), scene.hand.hands
    path, work = path_of(scene, scene.stick.z_ss_m), np.zeros((hands, ticks + 1))
    rows: list[Numbers] = []
    for hand in range(hands):
        law, motion = law_of(scene), thrown(scene, 0.0)
        law["z_ss"] = motion["z"] = hand_at(path[0], _NO_PATH, 0.0)
        out = np.zeros((most, len(simulate.COLUMNS)))
        late_s = scene.hand.gesture_period_s * hand / hands
        count = _carry(law[0], motion[0], path[0], _NO_PATH, late_s, tick_s, out, work[hand])
        if count > most:
            raise simulate.TooLong(f"more than {most} contacts in {duration_s:g} s")
        rows.append(out[:count])
    contacts = np.concatenate(rows)
    hand_of = np.repeat(np.arange(hands), [len(each) for each in rows])
    order = np.argsort(contacts[:, simulate.COLUMNS.index("t_in_s")], kind="stable")
    return Hands(contacts[order], hand_of[order], work, tick_s)
