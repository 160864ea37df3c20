"""A hand that changes while it plays: K_hand(t), R_out(t) and z_ss(t) of equation (1), from a recorded gesture.

The gesture is played on the law that is set: K_hand in proportion to the scene's own, R_out and z_ss as far above it as
in the file. So what is set live moves the whole gesture, and with the scene's own values the file is played as written.

The exact stick's grip stands still over each segment, a tick of [servo] rate_Hz, at the value that the file has in its
middle; between steps the motion is exact. A steady change is then met on average: the error falls with the square of
the tick (tests/physics/drumstick/stick/test_moving_hand.py measures it).

A hand that is no machine ([hand.human], drumstick.stick.human) follows no file: it changes at each release.
"""

import math

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick import simulate
from drumstick.stick.hand_path import between, place_on
from drumstick.stick.human import spread, unevenness
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.motion.transitions import force_now
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record, dtype_of, fields_of

Numbers = npt.NDArray[np.float64]

_SHARE, _DAMPING, _HEIGHT = 1, 2, 3  # columns of a path
_BLOCK = 1024
STILL: Numbers = np.column_stack([[0.0, 1.0], np.full((2, 5), np.nan)])  # a gesture that moves nothing


class MovingHand(Record):
    """Hand of a gesture: t_s in it; what the set has, K_hand (N/m), R_out (N s/m), z_ss (m); what the gesture makes of
    that now: a share of K_hand, R_out (N s/m) and height (m) on top. highest_m: the largest height of the gesture;
    lifts: 1 where it moves z_ss.
    """

    t_s: float
    k_hand: float
    r_out: float
    z_ss: float
    share: float
    damping: float
    height_m: float
    highest_m: float
    lifts: int


HAND = dtype_of(MovingHand)


def path_of(scene: Scene, gesture: Numbers) -> Numbers:
    """Path of a gesture (drumstick.scenes.gesture), shape (n, 4): time (s), share of K_hand, R_out and z_ss on top."""
    stick = scene.stick
    own = np.array([stick.k_hand_N_per_m, stick.r_out_N_s_per_m, stick.z_ss_m])
    k_hand, r_out, z_ss = np.where(np.isnan(gesture[:, (4, 5, 3)]), own, gesture[:, (4, 5, 3)]).T
    share = k_hand / own[0] if own[0] > 0.0 else np.ones_like(k_hand)
    return np.column_stack([gesture[:, 0], share, r_out - own[1], z_ss - own[2]])


def hand_of(scene: Scene, gesture: Numbers) -> npt.NDArray[np.void]:
    """The hand at the beginning of a gesture, shape (1,). Raises drumstick.stick.human.spread.NoSuchSpread.

    It has a part `human` where the scene's hand is no machine.
    """
    path, hand = path_of(scene, gesture), np.zeros(1, HAND)
    if scene.hand.human is not None:
        hand = np.zeros(1, np.dtype([spread.PART, *fields_of(MovingHand)], align=True))
        hand["human"] = spread.hand_of(scene)["human"]
    hand["highest_m"] = path[:, _HEIGHT].max()
    hand["lifts"] = np.ptp(path[:, _HEIGHT]) > 0.0
    hand["share"], hand["damping"], hand["height_m"] = path[0, 1:]
    hand["k_hand"], hand["r_out"] = scene.stick.k_hand_N_per_m, scene.stick.r_out_N_s_per_m
    hand["z_ss"] = scene.stick.z_ss_m
    return hand


@njit()
def look(hand: MovingHand, path: Numbers, t_s: float) -> None:
    """Let the hand do what its gesture does at t_s."""
    row, share = place_on(path, t_s)
    hand.share = between(path, _SHARE, row, share)
    hand.damping = between(path, _DAMPING, row, share)
    hand.height_m = between(path, _HEIGHT, row, share)


@njit()
def hold(hand: MovingHand, law: Law) -> None:
    """Put what the hand does now into the law. It is never tighter than the damping in contact, R_in."""
    law.k_hand = hand.share * hand.k_hand
    law.r_out = min(hand.r_out + hand.damping, max(law.r_in, hand.r_out))
    law.z_ss = hand.z_ss + hand.height_m
    unevenness.hold(hand, law)


@njit()
def take(hand: MovingHand, law: Law) -> None:
    """Take the law as what is set, and hold it as the gesture does now."""
    hand.k_hand, hand.r_out, hand.z_ss = law.k_hand, law.r_out, law.z_ss
    unevenness.take(hand, law)
    hold(hand, law)


@njit()
def put_back(hand: MovingHand, law: Law) -> None:
    """Put what is set into the law."""
    law.k_hand, law.r_out, law.z_ss = hand.k_hand, hand.r_out, hand.z_ss
    unevenness.put_back(hand, law)


@njit()
def makes_worse(hand: MovingHand) -> bool:
    """True when the hand can make of a set what the envelope has to judge besides the set itself."""
    return hand.highest_m > 0.0 or unevenness.is_there(hand)


@njit()
def hold_worst(hand: MovingHand, law: Law) -> None:
    """Make of a law that is set the worst that the hand can come to."""
    law.z_ss += max(hand.highest_m, 0.0)
    unevenness.hold_worst(hand, law)


@only_with("human")
def release(hand: MovingHand, law: Law, motion: Motion) -> None:
    """The stick has just left the head: what a hand that is no machine does until it leaves it again."""
    unevenness.draw(hand, law, motion)
    hold(hand, law)


@njit()
def go_on(hand: MovingHand, path: Numbers, span_s: float) -> None:
    """The gesture goes on by span_s: the hand does what it does in the middle of it."""
    look(hand, path, hand.t_s + 0.5 * span_s)
    period = path[path.shape[0] - 1, 0] - path[0, 0]
    hand.t_s += span_s
    if hand.t_s >= period:
        hand.t_s -= period * math.floor(hand.t_s / period)


@njit()
def may_lift(hand: MovingHand, motion: Motion) -> None:
    """A stick that lies in the head, or hangs above it, is at no end where the hand moves and comes above the head."""
    if hand.lifts != 0 and hand.z_ss + hand.highest_m > 0.0:
        motion.outcome = exact.MOVING


@njit()
def _advance(
    law: Law, motion: Motion, hand: MovingHand, path: Numbers, tick_s: float, clock: Numbers, most_s: float
) -> tuple[int, float]:
    # Like exact.advance, to the end of the present tick at most. clock[2]: what is left of that.
    if clock[2] <= 0.0:
        go_on(hand, path, tick_s)
        hold(hand, law)
        clock[2] = tick_s
    horizon = min(clock[2], most_s)
    event, moved = exact.advance(law, motion, horizon)
    if moved == 0.0 and motion.outcome == exact.CAPTURED:
        event, moved = exact.HORIZON, horizon  # it lies on the head: the same event until the hand moves on
    if event == exact.RELEASE:
        release(hand, law, motion)
    clock[2] = 0.0 if event == exact.HORIZON and horizon == clock[2] else clock[2] - moved
    return event, moved


@njit()
def _run(
    law: Law,
    motion: Motion,
    hand: MovingHand,
    path: Numbers,
    tick_s: float,
    clock: Numbers,
    duration: float,
    out: Numbers,
) -> int:
    # Fills rows of `out`, columns as simulate.COLUMNS, as simulate does.
    rows = 0
    while rows < out.shape[0] and clock[0] < duration and motion.outcome == exact.MOVING:
        event, moved = _advance(law, motion, hand, path, tick_s, clock, duration - clock[0])
        simulate.count(clock, moved)
        if simulate.has_left_head(motion, event):
            simulate.fill(law, motion, clock[0], clock[1], out[rows])
            rows += 1
        may_lift(hand, motion)
    return rows


def play(
    scene: Scene,
    gesture: Numbers,
    duration_s: float,
    v0_m_per_s: float,
    most_contacts: float = math.inf,
    tick_s: float | None = None,
) -> simulate.Run:
    """Play the scene's stick for `duration_s`, thrown as by `simulate`, in a hand that begins its gesture at the throw.

    tick_s: how long the grip stands still; None: as live, a tick of the servo. Raises TooLong when more than
    `most_contacts` would have to be kept, give or take a thousand.
    """
    law, motion, hand = law_of(scene), thrown(scene, v0_m_per_s), hand_of(scene, gesture)
    path, clock, blocks = path_of(scene, gesture), np.zeros(3), list[Numbers]()
    tick_s = 1.0 / scene.servo.rate_Hz if tick_s is None else tick_s
    while True:
        out = np.zeros((_BLOCK, len(simulate.COLUMNS)))
        rows = _run(law[0], motion[0], hand[0], path, tick_s, clock, duration_s, out)
        blocks.append(out[:rows])
        if rows < _BLOCK:
            break
        if len(blocks) * _BLOCK > most_contacts:
            raise simulate.TooLong(
                f"more than {most_contacts:g} contacts in the first {float(clock[0]):.6g} s"
            )
    return simulate.Run(np.concatenate(blocks), simulate.ENDS[int(motion["outcome"][0])], float(clock[0]))


@njit()
def _sample(
    law: Law,
    motion: Motion,
    hand: MovingHand,
    path: Numbers,
    tick_s: float,
    clock: Numbers,
    steps: Numbers,
    out: Numbers,
) -> None:
    for i in range(steps.shape[0]):
        gone = 0.0
        while gone < steps[i]:
            gone += _advance(law, motion, hand, path, tick_s, clock, steps[i] - gone)[1]
            may_lift(hand, motion)
        out[0, i], out[1, i], out[2, i] = motion.z, motion.v, force_now(law, motion)


def carried(
    scene: Scene, gesture: Numbers, v0_m_per_s: float, steps_s: Numbers
) -> tuple[Numbers, Numbers, Numbers]:
    """Height, speed and force after each of these steps (s, from 0), shape (points,), of what `play` plays."""
    law, motion, hand = law_of(scene), thrown(scene, v0_m_per_s), hand_of(scene, gesture)
    out, tick_s = np.empty((3, len(steps_s))), 1.0 / scene.servo.rate_Hz
    _sample(law[0], motion[0], hand[0], path_of(scene, gesture), tick_s, np.zeros(3), steps_s, out)
    return out[0], out[1], out[2]
