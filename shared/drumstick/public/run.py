"""Runs of the stick: `simulate`, and what it returns. Any thread; blocks while it computes."""

import math
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import require_in_range
from drumstick.parameters.scene import Scene, require_scene
from drumstick.scenes.gesture import played_gesture
from drumstick.stick import moving_hand
from drumstick.stick import simulate as stick
from drumstick.stick.contact_ahead import MAX_S
from drumstick.stick.hands import play
from drumstick.stick.law import law_of, thrown
from drumstick.stick.strike_curve import curve_of, level_of
from drumstick.stick.trajectory import carried

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drumstick.drum.memory.strikes import OfflineStrike

CONTACT = np.dtype([(name, np.float64) for name in (*stick.COLUMNS, "level")])


class Motion(NamedTuple):
    """Height (m), speed (m/s, up is positive) and the head's force on the stick (N), each of the shape of the times."""

    z_m: npt.NDArray[np.float64]
    v_m_per_s: npt.NDArray[np.float64]
    force_N: npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Run:
    """A stick that was thrown from the head and played for `duration_s`.

    contacts: one row for each contact that ended, a structured array of shape (n,) with the columns `t_in_s`, `t_out_s`
    (s: begin and end), `v_in_m_per_s`, `v_out_m_per_s` (speed at both, m/s, up is positive), `v_e_m_per_s` (with what
    its pulse still adds), `peak_force_N`, `impulse_N_s`, `z_min_m` (deepest point, m), `level` (0 .. 1, by the scene's
    strike curve). Of two hands ([hand] hands = 2) it has the contacts of both sticks, by the time at which they begin.
    end: "time", or earlier "captured" (it rests in the head) or "left" (it never comes back), at t_end_s. rate_Hz:
    contacts a second, by the last two, of two hands by the last five; NaN with fewer. stepper: None for the exact
    motion. gesture: CSV text of a recorded one that was given.

    >>> import drumstick as ds
    >>> run = ds.simulate(ds.scene("roll"), 2.0)
    >>> run
    Run(roll: 46 contacts in 2 s, 23.1 Hz)
    >>> float(run.contacts["v_e_m_per_s"][-1].round(4))
    0.6278
    """

    scene: Scene
    duration_s: float
    v0_m_per_s: float
    stepper: stick.Stepper | None
    contacts: npt.NDArray[np.void]
    end: stick.End
    t_end_s: float
    rate_Hz: float
    gesture: str | None = None

    def motion(self, t_s: npt.ArrayLike) -> Motion:
        """Height, speed and force at these times, s, in any order and of any shape: the exact solution, not a grid's.

        Computed anew from the throw. Raises ValueError for a time outside 0 .. duration_s, for a run by a stepper,
        which keeps its contacts only, and for two sticks, which have two motions.

        >>> import drumstick as ds
        >>> z_m, v_m_per_s, force_N = ds.simulate(ds.scene("roll"), 1.0).motion([0.0, 0.01, 0.02])
        >>> [round(1e3 * z, 2) for z in z_m.tolist()]
        [0.0, 2.49, 1.96]
        """
        if self.stepper is not None:
            raise ValueError(
                f"a run by {self.stepper.name} has no motion between its steps: simulate exactly"
            )
        if self.scene.hand.hands != 1:
            raise ValueError(f"{self.scene.name} has two sticks, which have no motion in common")
        times = np.asarray(t_s, np.float64)
        if not np.all((times >= 0.0) & (times <= self.duration_s)):  # NaN fails it
            raise ValueError(f"a time lies outside 0 .. {self.duration_s:g} s")
        order = np.argsort(times, axis=None, kind="stable")
        steps = np.diff(times.ravel()[order], prepend=0.0)
        found = np.empty((3, times.size))
        gesture = played_gesture(self.scene, self.gesture)
        if gesture is not None:
            found[:, order] = moving_hand.carried(self.scene, gesture, self.v0_m_per_s, steps)
        else:
            found[:, order] = carried(law_of(self.scene), thrown(self.scene, self.v0_m_per_s), steps)
        return Motion(*(part.reshape(times.shape) for part in found))

    def drum_strikes(self) -> "list[OfflineStrike]":
        """Blows that its contacts are for the scene's drum, on the circle on which the scene's hand walks."""
        from drumstick.drum.calibrate import strike_for_speed
        from drumstick.drum.memory.strikes import OfflineStrike

        hand, blows = self.scene.hand, list[OfflineStrike]()
        for contact in self.contacts:
            t_s, speed = float(contact["t_in_s"]), -float(contact["v_in_m_per_s"])
            turn = 2.0 * math.pi * t_s / hand.orbit_period_s
            x, y = hand.orbit_radius * math.cos(turn), hand.orbit_radius * math.sin(turn)
            lasts_s = float(contact["t_out_s"]) - t_s
            if lasts_s > MAX_S:  # a press, announced as a lone blow
                blows.append(strike_for_speed(self.scene, speed, x, y, t_s))
            else:
                peak, impulse = float(contact["peak_force_N"]), float(contact["impulse_N_s"])
                stroke = self.scene.strike.stroke_at(float(contact["level"]), speed)
                blows.append(OfflineStrike(t_s, x, y, peak, lasts_s, impulse, stroke))
        return blows

    def to_pandas(self) -> Any:
        """The contacts as a pandas.DataFrame. Raises ImportError without pandas, which nothing here needs."""
        return import_module("pandas").DataFrame(self.contacts)

    def plot(self, begin_s: float = 0.0, end_s: float = 0.5) -> "Figure":
        """Height and force from begin_s to end_s, drawn by matplotlib."""
        from drumstick.public.plots import over_time

        t_s = np.linspace(begin_s, min(end_s, self.duration_s), 4001)
        moved = self.motion(t_s)
        return over_time(
            self.scene.name, t_s, {"height, mm": 1e3 * moved.z_m, "force on the stick, N": moved.force_N}
        )

    def __repr__(self) -> str:
        rate = "" if math.isnan(self.rate_Hz) else f", {self.rate_Hz:.1f} Hz"
        ended = "" if self.end == "time" else f", {self.end} at {self.t_end_s:.4g} s"
        return f"Run({self.scene.name}: {len(self.contacts)} contacts in {self.duration_s:g} s{rate}{ended})"


def simulate(
    scene: Scene,
    duration_s: float,
    v0_m_per_s: float | None = None,
    stepper: stick.Stepper | None = None,
    most_contacts: float = math.inf,
    gesture: str | None = None,
) -> Run:
    """Play the scene's stick for duration_s (s): equations (1) and (2) of the paper with the scene's effects.

    It is thrown from z = 0 upwards at v0_m_per_s (below 0: into the head); None: the scene's own throw. The motion is
    exact, from event to event in closed form, unless a stepper is given (`ds.Stepper("rk4", 1e-5)`). Two hands
    ([hand] hands = 2) play a stick each, from rest in the lifted hand: nobody throws those. A recorded gesture ([hand]
    gesture = "recorded", [device] plant = "stick") moves the hand and its grip from the throw on, again and again;
    gesture: its CSV text where it is not shipped.

    Raises ValueError for a duration that is not above 0 s and finite, for a stick built in Python with a number that no
    scene may have, and for a stepper with two hands or a gesture; TooLong where there would be more than most_contacts,
    give or take a thousand, and for two hands over an hour; SceneError for a gesture that is not good or not there.

    >>> import drumstick as ds
    >>> ds.simulate(ds.scene("roll"), 10.0)
    Run(roll: 231 contacts in 10 s, 23.1 Hz)
    >>> ds.simulate(ds.scene("roll"), 10.0, v0_m_per_s=0.001)
    Run(roll: 0 contacts in 10 s, captured at 0.005483 s)
    """
    require_scene(scene)
    if not 0.0 < duration_s < math.inf:
        raise ValueError(f"a duration of {duration_s:g} s: give one above 0 s")
    require_in_range(scene.stick, "stick")
    v0 = scene.hand.throw_m_per_s if v0_m_per_s is None else v0_m_per_s
    if scene.hand.hands != 1:
        if stepper is not None:
            raise ValueError(
                f"{scene.name} has two sticks in hands that move: only the exact motion plays them"
            )
        run = stick.Run(play(scene, duration_s, most_contacts).contacts, "time", duration_s)
    elif (moves := played_gesture(scene, gesture)) is not None:
        if stepper is not None:
            raise ValueError(f"{scene.name} has a hand that moves: only the exact motion plays it")
        run = moving_hand.play(scene, moves, duration_s, v0, most_contacts)
    else:
        run = stick.simulate(scene, duration_s, v0, stepper, most_contacts)
    contacts = np.zeros(len(run.contacts), CONTACT)
    for name, column in zip(stick.COLUMNS, run.contacts.T, strict=True):
        contacts[name] = column
    curve = curve_of(scene.strike)[0]
    contacts["level"] = [level_of(curve, -v) for v in run.contacts[:, stick.COLUMNS.index("v_in_m_per_s")]]
    counted = 2 if scene.hand.hands == 1 else 5  # a double stroke of each hand
    begins = contacts["t_in_s"][-counted:]
    rate_Hz = (counted - 1) / float(begins[-1] - begins[0]) if len(begins) == counted else math.nan
    return Run(scene, duration_s, v0, stepper, contacts, run.end, run.t_end_s, rate_Hz, gesture)
