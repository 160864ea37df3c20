"""Errors of an uneven hand that make the spread that `[hand.human]` asks for, by the roll's own gain.

The roll remembers: what one error does to all strikes after it is played by the exact motion, a little more and a
little less of it, and errors that are independent add up by their squares. So the strikes' variances are linear in
those of the two errors, and two equations give them. Control thread; blocks for tenths of a second.
"""

import math

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick import composition
from drumstick.stick.human import unevenness
from drumstick.stick.human.unevenness import LARGEST, Unevenness
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit
from realtime.records import Record, fields_of

Numbers = npt.NDArray[np.float64]

PART = ("human", fields_of(Unevenness))  # of the record of a hand
_ALONE = np.dtype([PART], align=True)
_SETTLING, _ECHO = 400, 512  # strikes; the hand gets used to a change within some 64
_STEADY = 1e-6  # of the speed and of the interval
_SMALL = 0.005
_MOST_EVENTS = 16  # of a strike
_MOST_WAIT_S = 1.0
_MOST_DV, _MOST_PRESSING = 0.6, 0.9 / LARGEST  # the pulse seldom comes to 0, the pressing never
_DB = 20.0 / math.log(10.0)


class NoSuchSpread(ValueError):
    """Reason why a hand cannot play a scene's roll as unevenly as `[hand.human]` asks for."""


class _Hand(Record):
    human: Unevenness


@njit()
def _play(
    law: Law, motion: Motion, hand: _Hand, strength: float, pressure: float, varies: bool, out: Numbers
) -> bool:
    # Fills rows of `out`, speed of a strike (m/s) and time since the one before (s). The errors are those of the first
    # release. False where the roll ends before.
    z_ss, row, since_s, begun = law.z_ss, -1, 0.0, False
    unevenness.take(hand, law)
    for _ in range(_MOST_EVENTS * out.shape[0]):
        event, moved_s = exact.advance(law, motion, _MOST_WAIT_S)
        since_s += moved_s
        if motion.outcome != exact.MOVING:
            break
        if event == exact.RELEASE:
            v_e = motion.v_out + composition.remaining_speed(law, motion)
            if varies:
                unevenness.vary(hand.human, v_e, 0.0 if begun else strength, 0.0 if begun else pressure)
                law.z_ss = z_ss
                unevenness.hold(hand, law)
            else:
                hand.human.used_to_m_per_s = v_e
            begun = True
        elif event == exact.ENTRY:
            row += 1
            out[row, 0], out[row, 1], since_s = -motion.v_in, since_s, 0.0
            if row == out.shape[0] - 1:
                return True
    return False


def hand_of(scene: Scene) -> npt.NDArray[np.void]:
    """The unevenness of the hand that plays this scene, shape (1,), with one field, `human`.

    Raises NoSuchSpread, in words, where its roll does not repeat strike by strike or cannot be as uneven as asked for.
    """
    asked = scene.hand.human
    assert asked is not None, "a scene without [hand.human] has no uneven hand"
    law, motion, hand = law_of(scene), thrown(scene, scene.hand.throw_m_per_s), np.zeros(1, _ALONE)
    human = hand["human"]
    human["dv_factor"] = human["pressing"] = 1.0
    human["seed"] = asked.seed
    settled = np.zeros((_SETTLING, 2))
    if not (
        _play(law[0], motion[0], hand[0], 0.0, 0.0, False, settled)
        and np.all(np.abs(np.ptp(settled[-4:], axis=0)) <= _STEADY * settled[-1])
    ):
        raise NoSuchSpread("its stick, thrown, does not come to a roll that repeats strike by strike")
    variances = np.array([_variances(law, motion, hand, error) for error in ((1.0, 0.0), (0.0, 1.0))]).T
    wanted = np.array([asked.level_dB / _DB, 0.01 * asked.interval_percent]) ** 2
    dv, pressing = np.linalg.solve(variances, wanted)
    if pressing < 0.0:
        least = 100.0 * math.sqrt(variances[1, 0] * wanted[0] / variances[0, 0])
        raise NoSuchSpread(
            f"level_dB = {asked.level_dB:g} alone spreads its intervals by {least:.2g} %: ask for a larger "
            "interval_percent or a smaller level_dB"
        )
    if dv < 0.0:
        least = _DB * math.sqrt(variances[0, 1] * wanted[1] / variances[1, 1])
        raise NoSuchSpread(
            f"interval_percent = {asked.interval_percent:g} alone spreads its levels by {least:.2g} dB: ask for a "
            "larger level_dB or a smaller interval_percent"
        )
    human["dv_spread"], human["pressing_spread"] = math.sqrt(dv), math.sqrt(pressing)
    if human["dv_spread"] > _MOST_DV or human["pressing_spread"] > _MOST_PRESSING:
        raise NoSuchSpread(
            f"its pulses would have to vary by {100.0 * math.sqrt(dv):.2g} % (at most {100.0 * _MOST_DV:g}) and its "
            f"hand by {100.0 * math.sqrt(pressing):.2g} % (at most {100.0 * _MOST_PRESSING:g}): ask for less of both"
        )
    return hand


def _variances(
    law: npt.NDArray[np.void],
    motion: npt.NDArray[np.void],
    hand: npt.NDArray[np.void],
    error: tuple[float, float],
) -> Numbers:
    # Of the logarithms of speed and interval, shape (2,), by independent errors of variance 1 at every strike.
    echoes = list[Numbers]()
    for small in (_SMALL, -_SMALL):
        own, out = hand.copy(), np.zeros((_ECHO, 2))
        own["human"]["dv_spread"] = own["human"]["pressing_spread"] = 1.0
        strength, pressure = small * error[0], small * error[1]
        if not _play(law.copy()[0], motion.copy()[0], own[0], strength, pressure, True, out):
            raise NoSuchSpread("its roll dies of the smallest error")
        echoes.append(np.log(out))
    return (((echoes[0] - echoes[1]) / (2.0 * _SMALL)) ** 2).sum(axis=0)
