"""Values for a roll of a wanted rate and level: the inverse of the prediction (`cycles.settling.settle`).

    inverse = Inverse(scene, limits)
    roll = inverse.towards(inverse.present(law), rate_Hz=30.0, level=0.4)
    moved(roll)     # {"k_hand": ..., "z_ss": ..., "dv_pls": ...}

The equations between two events are linear, so a roll whose z_ss and dv_pls are both c times as large is c times as
fast at the same rate. So the level moves z_ss and dv_pls together, and the rate moves k_hand and dv_pls; z_ss keeps its
ratio to the speed, and there and back again gives the same values. Effects of the head make this a first guess only:
Newton's method on one exact return does the rest, and a throw played to its end has the last word.

Any thread, one at a time; blocks for 3 ms, where nothing is found for up to 30 ms, once the kernels are compiled.
"""

import math
from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.return_map import OF_V_OUT, ReturnMap
from drumstick.analysis.cycles.return_step import Numbers
from drumstick.analysis.cycles.settling import settle
from drumstick.analysis.ramp import STEP_S, Leg, Ramp, Stand
from drumstick.analysis.unpulsed import why_no_roll
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.table import Refusal, table_of, with_changes
from drumstick.stick.law import Records, law_of
from drumstick.stick.motion import exact
from drumstick.stick.strike_curve import level_at

UNCHANGED = 0.005  # a request so near to what holds changes nothing

_NEWTON_STEPS = 10
_SMALL = 1e-6
_LONGEST_STEP = 0.7  # in one step of Newton's method, of the logarithms
_CLOSED = 1e-8
# contacts after which a throw has to have come to the roll: then it is stable, and nobody waits long
_PLAYED = 256
_SETTLED = 1e-3
_NEAREST = 2e-3  # of the logarithms: how near to the border of what can be reached the nearest roll lies
_LOWEST_RATE_HZ, _HIGHEST_RATE_HZ = 0.1, 1000.0
_LONGEST_RAMP_S = 600.0
_NODE = 0.02  # of the logarithms: how far apart the returns of a ramp lie that are solved
_NOTHING = 1e-300  # a z_ss of 0 has no logarithm


class Roll(NamedTuple):
    """A settled roll: rate Hz; level 0 .. 1 of its strikes, their speed, and that after them, m/s; contact s.

    law: shape (1,), with the values that make it.
    """

    rate_Hz: float
    level: float
    speed_m_per_s: float
    v_out_m_per_s: float
    contact_s: float
    law: Records

    @property
    def stand(self) -> Stand:
        """Rate and speed."""
        return Stand(self.rate_Hz, self.speed_m_per_s)


class _Closed(Refusal):
    # Values that are known, and may not be.
    pass


class Unreachable(Refusal):
    """A rate and level that cannot be met; `nearest` is the roll that comes nearest on the way there."""

    def __init__(self, words: str, nearest: Roll) -> None:
        super().__init__(words)
        self.nearest = nearest


class Inverse:
    """Inverse of one scene's prediction, within `limits`; without them: those of the scene's own guard."""

    def __init__(self, scene: Scene, limits: envelope.Limits | None = None) -> None:
        """Raises Refusal where `why_no_roll` says why."""
        if why := why_no_roll(scene):
            raise Refusal(why)
        self._scene, self._table = scene, table_of(scene)
        self._limits = limits or envelope.Limits.of(scene)
        self._law = law_of(scene)  # the one that `_map` looks at
        self._scratch = return_step.scratch_of(scene)
        self._states = np.zeros((_PLAYED, return_step.STATE_SIZE))
        self._measured = np.zeros((_PLAYED, return_step.MEASURED_SIZE))
        self._map = ReturnMap(self._law, self._scratch, 1, return_step.FEW_WAIT_DOUBLINGS)

    def roll(self, law: Records) -> Roll | None:
        """The roll that a throw with these values ends in; None when it ends otherwise, or strokes alternate."""
        cycle = settle(law, self._scratch, self._scene.hand.throw_m_per_s).cycle
        if cycle is None or cycle.period != 1 or not cycle.stable:
            return None
        speed = -cycle.v_in_m_per_s
        v_out = float(cycle.states[0, return_step.V_OUT])
        return Roll(cycle.rate_Hz, level_at(self._scene.strike, speed), speed, v_out, cycle.contact_s, law)

    def present(self, law: Records) -> Roll:
        """The roll that `law` leads to, or that it would lead to with the scene's own k_hand, z_ss and dv_pls.

        Raises Refusal where both lead to none.
        """
        if found := self.roll(law):
            return found
        own = with_changes(law, self._table, moved(law_of(self._scene)))
        if found := self.roll(own):
            return found
        raise Refusal("these values make no steady roll, nor would the scene's own k_hand, z_ss and dv_pls")

    def towards(self, now: Roll, rate_Hz: float | None = None, level: float | None = None) -> Roll:
        """The roll of this rate and level; None: as `now` has it. It is `now` where nothing has to change.

        Raises Unreachable, and Refusal for what is no rate or no level.
        """
        goal = self._goal(now, rate_Hz, level)
        if _holds(now, rate_Hz, level):
            return now
        found, way, step, why = now, 0.0, 1.0, Refusal()
        while way < 1.0:
            step = min(step, 1.0 - way)
            try:
                found = self._settled(found, now.stand.towards(goal, way + step, way + step))
            except Refusal as refusal:
                why = why if isinstance(why, _Closed) else refusal
                step *= 0.5
                if step * now.stand.distance(goal) < _NEAREST:
                    wanted, nearest = self._words(goal), self._words(found.stand)
                    raise Unreachable(f"{wanted} cannot be met: {why}; nearest: {nearest}", found) from None
            else:
                way, step = way + step, 2.0 * step
        return found

    def _goal(self, now: Roll, rate_Hz: float | None, level: float | None) -> Stand:
        rate, speed = now.rate_Hz if rate_Hz is None else rate_Hz, now.speed_m_per_s
        if not _LOWEST_RATE_HZ <= rate <= _HIGHEST_RATE_HZ:
            raise Refusal(f"rate: {rate:g} Hz is outside {_LOWEST_RATE_HZ:g} .. {_HIGHEST_RATE_HZ:g} Hz")
        if level is not None:
            if not 0.0 < level <= 1.0:
                raise Refusal(f"level: {level:g} is outside 0 .. 1; at 0 nothing is heard")
            speed = self._scene.strike.speed_at(level)
            if not speed > 0.0:
                raise Refusal(f"level: no strike of this scene has the level {level:g}")
        return Stand(rate, speed)

    def _words(self, stand: Stand) -> str:
        level = level_at(self._scene.strike, stand.speed_m_per_s)
        return f"{stand.rate_Hz:.3g} Hz at level {level:.3g}"

    def _settled(self, near: Roll, wanted: Stand) -> Roll:
        # The roll there, if throws lead to it: from rest, and in the midst of a roll.
        found = self.played(near, wanted)
        for throw in (self._scene.hand.throw_m_per_s, found.v_out_m_per_s):
            self._scratch[0] = self._scratch[1]
            self._scratch[0]["v"] = throw
            outcome = return_step.iterate(
                found.law[0], self._scratch[0], self._states, return_step.FEW_WAIT_DOUBLINGS, self._measured
            )
            ends = self._states[-2:, return_step.V_OUT] / found.v_out_m_per_s - 1.0
            if outcome != exact.MOVING or np.max(np.abs(ends)) > _SETTLED:
                raise Refusal(
                    f"a stick at {throw:.3g} m/s would come to rest in the head, or not come to this roll"
                )
        return found

    def ramp(self, start: Roll, rate: Leg, level: Leg) -> tuple[Ramp, Roll]:
        """The ramp, and its end, which is `start` itself where nothing has to change.

        A roll follows its values only after some contacts, and its rate depends on how hard it has become until then:
        steady rolls in a row would lag. So each return is solved for what the ramp is at its end: it starts at one
        speed and meets the head at the next. k_hand and z_ss act throughout a return and are those of the one that is
        half over; dv_pls acts at its beginning. Raises Refusal where the end, or something on the way, cannot be met.
        """
        for leg in (rate, level):
            if not 0.0 <= leg.seconds <= _LONGEST_RAMP_S:
                raise Refusal(f"a ramp of {leg.seconds:g} s: send 0 .. {_LONGEST_RAMP_S:g} s")
        end = self.towards(start, rate.to, level.to)
        ramp = Ramp(start.stand, end.stand, end.level, rate, level, moved(end.law), end.contact_s, [], {})
        seconds = max(rate.seconds, level.seconds)
        if seconds < STEP_S or end is start:
            return ramp, end
        nodes = 2 + math.ceil(start.stand.distance(end.stand) / _NODE)
        times_s = ramp.lead_s + np.linspace(0.0, seconds, nodes)
        for moment in (0.0, rate.seconds, level.seconds):  # returns that begin or end at a bend
            bend_s = ramp.lead_s + moment
            half_s = 0.5 / ramp.stands_at(bend_s).rate_Hz
            times_s = np.union1d(times_s, [bend_s - half_s, bend_s + half_s])
        found = start
        for time_s in times_s.tolist():
            rate_Hz, _ = ramp.stands_at(time_s)
            before, after = (ramp.stands_at(time_s + half / rate_Hz) for half in (-0.5, 0.5))
            wanted = Stand(rate_Hz, math.sqrt(before.speed_m_per_s * after.speed_m_per_s))
            louder, faster = after.speed_m_per_s / before.speed_m_per_s, after.rate_Hz / before.rate_Hz
            found = self.played(found, wanted, louder, faster)
            for name, value in moved(found.law).items():
                ramp.logarithms.setdefault(name, []).append(math.log(max(abs(value), _NOTHING)))
        return ramp._replace(times_s=times_s.tolist()), end

    def played(self, near: Roll, wanted: Stand, louder: float = 1.0, faster: float = 1.0) -> Roll:
        """The values with which contacts at this speed and rate follow one another. near: to search from.

        Where both grow, by these factors from one contact to the next: the values amid the flight between them, and
        speed and rate there. Whether a throw would come there is not asked. Raises Refusal where there are none within
        the ranges, the envelope and the workspace, or where a small departure would grow.
        """
        rate_Hz, speed = wanted
        scale = speed / near.speed_m_per_s
        # A pull that grows in flight brings the stick back as early as a steady one which is smaller than that amid
        # the flight; and faster, since at the end it is larger. The exponents are those of the shipped rolls.
        pull = louder * faster**2
        self._law[:] = near.law
        self._law["z_ss"] *= scale * pull ** (-1.0 / 12.0)
        growth = louder * pull ** (-1.0 / 6.0)
        goal = np.array([speed * growth / louder**0.5, 1.0 / rate_Hz, growth])
        v_out, k_hand, dv = self._newton(near, goal, scale).tolist()
        values = {"k_hand": k_hand, "z_ss": float(near.law["z_ss"][0]) * scale, "dv_pls": dv}
        try:
            law = with_changes(near.law, self._table, values)
            envelope.require(law, self._limits)
        except Refusal as refusal:
            needed = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
            raise _Closed(f"it needs {needed}: {refusal}") from None
        measured, highest = self._map.measured[0], self._scene.guard.highest_m
        if not (apex := measured[return_step.APEX_M]) < highest:
            why = f"the stick would rise to {apex:.3g} m, the limit is {highest:g} m ([guard] highest_m)"
            raise Refusal(why)
        level, contact_s = level_at(self._scene.strike, speed), float(measured[return_step.CONTACT_S])
        return Roll(rate_Hz, level, speed, v_out, contact_s, law)

    def _newton(self, near: Roll, wanted: Numbers, scale: float) -> Numbers:
        # v_out, k_hand and dv_pls of a return that has this v_in, period and growth: all by their logarithms.
        start = [near.v_out_m_per_s * scale, near.law["k_hand"][0], near.law["pulse"]["dv_pls"][0] * scale]
        if not min(start) > 0.0:
            raise Refusal("rate and level need a k_hand and a dv_pls above 0")
        self._map.forget()
        at, goal = np.log(start), np.log(wanted)
        multiplier = 0.0
        missing = self._logarithms(at) - goal
        for _ in range(_NEWTON_STEPS):
            if np.max(np.abs(missing)) < _CLOSED and abs(multiplier) < 1.0:
                return np.exp(at)
            beside = [self._logarithms(at + step) - goal for step in _SMALL * np.eye(3)]
            matrix = (np.array(beside) - missing).T / _SMALL
            if not np.all(np.isfinite(matrix)):
                break
            multiplier = 1.0 + matrix[2, 0]  # of a departure of v_out
            move = -np.linalg.lstsq(matrix, missing, rcond=None)[0]
            at += move * min(1.0, _LONGEST_STEP / max(float(np.max(np.abs(move))), _CLOSED))
            missing = self._logarithms(at) - goal
        raise Refusal("no steady roll is that fast or that slow at this level")

    def _logarithms(self, at: Numbers) -> Numbers:
        # Logarithms of v_in, period and growth; NaN where the stick does not come round.
        v_out, k_hand, dv = np.exp(at)
        self._law["k_hand"], self._law["pulse"]["dv_pls"] = k_hand, dv
        if not self._map.at(float(v_out), OF_V_OUT):
            return np.full(3, math.nan)
        one = self._map.measured[0]
        after = self._map.states[0, return_step.V_OUT]
        return np.log([-one[return_step.V_IN], one[return_step.PERIOD_S], after / v_out])


def moved(law: Records) -> dict[str, float]:
    """Values in `law`, shape (1,), that the inverse moves, by wire name."""
    dv = law["pulse"]["dv_pls"]
    return {"k_hand": float(law["k_hand"][0]), "z_ss": float(law["z_ss"][0]), "dv_pls": float(dv[0])}


def _holds(now: Roll, rate_Hz: float | None, level: float | None) -> bool:
    same_rate = rate_Hz is None or abs(rate_Hz / now.rate_Hz - 1.0) <= UNCHANGED
    return same_rate and (level is None or abs(level - now.level) <= UNCHANGED * now.level)
