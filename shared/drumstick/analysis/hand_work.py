"""Work of a roll's hands, and how even it is: of two hands that move, or of one that holds still.

A hand that holds its spring still does no work; its damper takes what the drum gives. Hands that move give a passive
drum all that it takes. Any thread; blocks for some tenths of a second once compiled.
"""

from dataclasses import dataclass

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.stick import hands
from drumstick.stick.simulate import COLUMNS, simulate

_SETTLING_PERIODS, _PERIODS = 8, 8
_SETTLING_S, _HELD_S = 8.0, 2.0
_T_IN, _V_IN, _V_OUT, _V_E = (
    COLUMNS.index(name) for name in ("t_in_s", "v_in_m_per_s", "v_out_m_per_s", "v_e_m_per_s")
)


class NoRoll(ValueError):
    """The scene's hands play no roll; says how few strikes there were."""


@dataclass(frozen=True)
class HandWork:
    """rate_Hz: strikes a second; strike_m_per_s: their mean speed. interval_variation, speed_variation: the standard
    deviation of the intervals between strikes and of their speeds, over the mean. hands_W: what each hand gives its
    stick, drum_W: what the drum gives by its pulses, at most (as if no other force took from a pulse), both W.

    strikes: shape (n, 3), time (s, from the first), speed (m/s) and hand of those that it was computed from.
    """

    rate_Hz: float
    strike_m_per_s: float
    interval_variation: float
    speed_variation: float
    hands_W: tuple[float, ...]
    drum_W: float
    strikes: hands.Numbers

    def as_json(self) -> dict[str, object]:
        """The JSON object `hand_work` of `drumstick analyse --json`."""
        names = ("rate_Hz", "strike_m_per_s", "interval_variation", "speed_variation", "hands_W", "drum_W")
        return {name: getattr(self, name) for name in names}


def _of(
    contacts: hands.Numbers,
    hand: hands.Numbers,
    begin_s: float,
    end_s: float,
    hands_W: tuple[float, ...],
    m_kg: float,
) -> HandWork:
    # Of the contacts that begin from begin_s up to before end_s, which are whole turns of the roll.
    chosen = (contacts[:, _T_IN] >= begin_s) & (contacts[:, _T_IN] < end_s)
    rows = contacts[chosen]
    if len(rows) < 3:
        raise NoRoll(
            f"the hands play no roll: {len(rows)} strikes in {end_s - begin_s:g} s, too few for a rate"
        )
    times, speeds = rows[:, _T_IN], -rows[:, _V_IN]
    following = contacts[contacts[:, _T_IN] >= end_s][:1, _T_IN]  # the interval that closes the last turn
    intervals = np.diff(np.concatenate([times, following]))
    lasts_s = float(intervals.sum())
    given = 0.5 * m_kg * (rows[: len(intervals), _V_E] ** 2 - rows[: len(intervals), _V_OUT] ** 2)
    return HandWork(
        rate_Hz=len(intervals) / lasts_s,
        strike_m_per_s=float(speeds.mean()),
        interval_variation=float(intervals.std() / intervals.mean()),
        speed_variation=float(speeds.std() / speeds.mean()),
        hands_W=hands_W,
        drum_W=float(given.sum()) / lasts_s,
        strikes=np.column_stack([times - times[0], speeds, hand[chosen]]),
    )


def hand_work(scene: Scene) -> HandWork:
    """Work and evenness of the scene's settled roll. Raises NoRoll where there is none."""
    m_kg = scene.stick.m_kg
    if scene.hand.hands == 1:
        end_s = _SETTLING_S + _HELD_S
        contacts = simulate(scene, end_s + _HELD_S, scene.hand.throw_m_per_s).contacts
        return _of(contacts, np.zeros(len(contacts)), _SETTLING_S, end_s, (0.0,), m_kg)
    period_s = scene.hand.gesture_period_s
    begin_s = _SETTLING_PERIODS * period_s
    end_s = begin_s + _PERIODS * period_s
    played = hands.play(scene, end_s + period_s)
    first, last = round(begin_s / played.tick_s), round(end_s / played.tick_s)
    given = (played.work_J[:, last] - played.work_J[:, first]) / ((last - first) * played.tick_s)
    watts = tuple(float(each) for each in given)
    return _of(played.contacts, played.hand.astype(np.float64), begin_s, end_s, watts, m_kg)
