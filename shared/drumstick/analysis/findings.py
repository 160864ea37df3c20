"""Everything the analysis finds out about a scene: `analyse`.

Any thread; blocks for some tenths of a second, the first time for as long as the kernels take to compile.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from drumstick.analysis import predictions
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.fixed_points import fixed_points
from drumstick.analysis.cycles.grips import Grip, grips_of
from drumstick.analysis.cycles.return_map import return_map
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import End, settle
from drumstick.analysis.effective import (
    SPEEDS_M_PER_S,
    Equation8,
    effective_restitution,
    equation_8,
    restitution_without_hand,
)
from drumstick.analysis.ends import Ends, ends_of
from drumstick.analysis.flight import flight
from drumstick.analysis.gain import overdamped
from drumstick.analysis.hand_work import HandWork, NoRoll, hand_work
from drumstick.analysis.rebound import capture_speed, rebound
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene, require_scene
from drumstick.scenes.gesture import stick_gesture
from drumstick.stick.law import law_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POINTS = 400  # of the curve of a return map


@dataclass(frozen=True, repr=False)
class Findings:
    """Results of `drumstick analyse`. None: the value does not exist.

    alpha and beta_measured are those of the primary cycle's own speeds, v_E and that at entry; without a cycle, of the
    scene's throw. primary: the index in `cycles` of the roll that the throw ends in, else of the stable one with the
    largest v_E, else of the first one. throw_ends: None for a scene whose motion never repeats, which `note` explains.

    beta_eq3: restitution by equation (3); alpha: speed back at the head over v_E; v_lc_eq7_m_per_s: speed of the roll
    by equation (7), v_lc_kappa_m_per_s with the pulse's own kappa. cycles: every roll there is, stable or not, by
    increasing v_E; equation_8: what (8) says of each of them. beta_without_hand: beta^ of `cor_pulse` alone,
    played without a hand; None where there is none. effective: beta^, what a blow at each of SPEEDS_M_PER_S
    is given back with all effects, None where it stays. capture_speed_m_per_s: a slower contact without a pulse ends at
    rest in the head. ends: which strike leads where, and what breaks a roll (drumstick.analysis.ends); None where
    nothing repeats. hand_work: what the roll of two hands that move costs them; None for one hand, and where
    they play no roll, as `note` says. grips: of a recorded gesture that moves the hand, what each of its grips would
    settle in, held still; all else is of the grip of `[stick]`, held still, which `note` says then. of: the
    scene itself.

    >>> import drumstick as ds
    >>> found = ds.analyse(ds.scene("roll"))
    >>> found
    Findings(roll: stable roll of 23.1 Hz; stable ends: 2)
    >>> round(found.capture_speed_m_per_s, 4), found.primary, found.throw_ends
    (0.0549, 0, 'cycle')
    >>> [(round(basin.from_m_per_s, 4), basin.end) for basin in found.ends.basins]
    [(0.0005, 'captured'), (0.0549, 'cycle')]
    >>> round(found.ends.withstands[0].least_m_per_s, 3)  # a strike so much slower breaks the roll
    0.504
    """

    scene: str
    beta_eq3: float | None
    beta_measured: float | None
    alpha: float | None
    capture_speed_m_per_s: float | None
    v_lc_eq7_m_per_s: float | None
    v_lc_kappa_m_per_s: float | None
    kappa: float | None
    cycles: tuple[Cycle, ...]
    equation_8: tuple[Equation8, ...]
    beta_without_hand: float | None
    effective: tuple[float | None, ...]
    primary: int | None
    overdamped: bool
    throw_ends: End | None
    ends: Ends | None
    hand_work: HandWork | None
    grips: tuple[Grip, ...]
    note: str | None
    of: Scene = field(compare=False)

    def plot(self) -> "Figure":
        """The return map, drawn by matplotlib: speed after a contact against that after the next, with the rolls.

        Its curve ends where no such contact comes: a slower one is captured, or no pulse leaves that little speed.
        Raises ValueError for a motion that never repeats, as `note` says, which has no such map.

        >>> import drumstick as ds
        >>> ds.analyse(ds.scene("roll")).plot().axes[0].get_xlabel()
        'speed after a contact, m/s'
        """
        from drumstick.public.plots import FixedPoint
        from drumstick.public.plots import return_map as drawn

        if self.throw_ends is None:
            raise ValueError(self.note)
        fastest = max((cycle.v_e_m_per_s for cycle in self.cycles), default=self.of.hand.throw_m_per_s)
        v_e = np.linspace(0.0, 2.0 * fastest, _POINTS)
        fixed = [
            FixedPoint(
                cycle.v_e_m_per_s,
                cycle.stable,
                f"{_kind(cycle)}: {cycle.rate_Hz:.1f} Hz, multiplier {cycle.multiplier:.2f}",
            )
            for cycle in self.cycles
            if cycle.period == 1
        ]
        return drawn(self.scene, v_e, return_map(self.of, v_e), fixed)

    def __repr__(self) -> str:
        rolls = [f"{_kind(cycle)} roll of {cycle.rate_Hz:.1f} Hz" for cycle in self.cycles]
        ends = [f"stable ends: {self.ends.count}"] if self.ends else []
        return f"Findings({self.scene}: {'; '.join([*(rolls or ['no roll that repeats']), *ends])})"

    def as_json(self) -> dict[str, Any]:
        """The JSON object of `drumstick analyse --json`."""
        cycles = [
            {
                "v_e_m_per_s": cycle.v_e_m_per_s,
                "rate_Hz": cycle.rate_Hz,
                "apex_m": cycle.apex_m,
                "contact_s": cycle.contact_s,
                "multiplier": cycle.multiplier,
                "stable": cycle.stable,
                "period": cycle.period,
                "primary": index == self.primary,
                "equation_8": by_8._asdict(),
                "withstands": self._withstands(cycle),
            }
            for index, (cycle, by_8) in enumerate(zip(self.cycles, self.equation_8, strict=True))
        ]
        names = (
            "scene", "beta_eq3", "beta_measured", "alpha", "capture_speed_m_per_s", "v_lc_eq7_m_per_s",
            "v_lc_kappa_m_per_s", "kappa", "beta_without_hand",
        )  # fmt: skip
        found: dict[str, Any] = {name: getattr(self, name) for name in names}
        found["effective"] = [
            {"v_in_m_per_s": -speed, "beta": beta}
            for speed, beta in zip(SPEEDS_M_PER_S, self.effective, strict=True)
        ]
        found |= {"cycles": cycles, "overdamped": self.overdamped, "throw_ends": self.throw_ends}
        found |= {"stable_ends": self.ends.count if self.ends else None, "basins": self._basins()}
        found["hand_work"] = self.hand_work.as_json() if self.hand_work else None
        found["grips"] = [grip._asdict() for grip in self.grips]
        return found | ({"note": self.note} if self.note is not None else {})

    def _withstands(self, cycle: Cycle) -> dict[str, float | None] | None:
        limits = self.ends.limits_of(cycle) if self.ends else None
        names = ("strike_m_per_s", "slowest_m_per_s", "fastest_m_per_s", "least_m_per_s")
        return {name: getattr(limits, name) for name in names} if limits else None

    def _basins(self) -> list[dict[str, Any]]:
        return [
            {
                "from_m_per_s": basin.from_m_per_s,
                "to_m_per_s": basin.to_m_per_s,
                "end": basin.end,
                "cycle": next((i for i, cycle in enumerate(self.cycles) if cycle is basin.cycle), None),
            }
            for basin in (self.ends.basins if self.ends else ())
        ]


def _kind(cycle: Cycle) -> str:
    return "stable" if cycle.stable else "unstable"


def _primary(cycles: list[Cycle], settled: Cycle | None) -> int | None:
    if settled is not None:
        return next(i for i, cycle in enumerate(cycles) if cycle.passes(settled.states[0]))
    stable = [i for i, cycle in enumerate(cycles) if cycle.stable]
    return stable[-1] if stable else (0 if cycles else None)


def _cycles(scene: Scene) -> tuple[list[Cycle], int | None, End, Ends]:
    # All cycles by increasing v_E, the primary one's index, how the throw ends, and how every strike does.
    law, scratch = law_of(scene), scratch_of(scene)
    cycles = fixed_points(law, scratch)
    settled = settle(law, scratch, scene.hand.throw_m_per_s)
    roll = settled.cycle
    if roll is not None and not any(cycle.passes(roll.states[0]) for cycle in cycles):
        cycles.append(roll)
    ends = ends_of(scene, law, scratch, cycles)
    cycles.sort(key=lambda cycle: cycle.v_e_m_per_s)
    return cycles, _primary(cycles, roll), settled.end, ends


def _note(endless: list[str], moves: bool, no_roll: str) -> str | None:
    notes = [no_roll] if no_roll else []
    if endless:
        notes.append(
            f"{', '.join(endless)}: the motion never repeats, so it has no cycles; "
            "alpha, beta and the capture speed are those without it"
        )
    if moves:
        notes.append(
            "the hand moves, as its gesture has it: the numbers are those of the grip of [stick] held still, and for "
            "each grip of the gesture there is the roll that it would settle in if it stayed"
        )
    return "; ".join(notes) or None


def _hand_work(scene: Scene) -> tuple[HandWork | None, str]:
    # Or why there is none.
    if scene.hand.hands == 1:
        return None, ""
    try:
        return hand_work(scene), ""
    except NoRoll as no_roll:
        return None, str(no_roll)


def analyse(scene: Scene, gesture: str | None = None) -> Findings:
    """Fixed points, multipliers, capture and what the paper's equations predict for them (docs/stick.md).

    The cycles are fixed points of the exact motion's return map, found by Newton's method; a multiplier below 1 in
    magnitude is a roll that comes back after a small disturbance. Blocks for some tenths of a second. A hand that a
    recorded gesture moves is predicted grip by grip, each as if it stayed (`Findings.grips`); gesture: its CSV text
    where it is not shipped. Raises SceneError for one that is not good or not there.

    >>> import drumstick as ds
    >>> [round(cycle.v_e_m_per_s, 4) for cycle in ds.analyse(ds.scene("roll")).cycles]
    [0.6278]
    """
    require_scene(scene)
    moves = stick_gesture(scene, gesture)
    endless = [name for name in NEVER_REPEATING if name in scene.effects]
    cycles, primary, throw_ends, ends = ([], None, None, None) if endless else _cycles(scene)
    roll = None if primary is None else cycles[primary]
    throw = scene.hand.throw_m_per_s
    flown = flight(scene, roll.v_e_m_per_s if roll else throw)
    struck = rebound(scene, -roll.v_in_m_per_s if roll else throw)
    work, no_roll = _hand_work(scene)
    alpha, beta = flown.alpha if flown else None, struck.beta if struck else None
    return Findings(
        scene=scene.name,
        beta_eq3=predictions.restitution_eq3(scene.stick),
        beta_measured=beta,
        alpha=alpha,
        capture_speed_m_per_s=capture_speed(scene),
        v_lc_eq7_m_per_s=predictions.v_lc_eq7(scene, alpha) if roll and alpha else None,
        v_lc_kappa_m_per_s=predictions.v_lc_kappa(scene, alpha, beta) if roll and alpha else None,
        kappa=predictions.kappa_of(scene),
        cycles=tuple(cycles),
        equation_8=tuple(equation_8(scene, cycle) for cycle in cycles),
        beta_without_hand=restitution_without_hand(scene),
        effective=tuple(
            float(beta) if np.isfinite(beta) else None
            for beta in effective_restitution(scene, np.array(SPEEDS_M_PER_S))
        ),
        primary=primary,
        overdamped=overdamped(scene.stick),
        throw_ends=throw_ends,
        ends=ends,
        hand_work=work,
        grips=grips_of(scene, moves),
        note=_note(endless, moves is not None, no_roll),
        of=scene,
    )
