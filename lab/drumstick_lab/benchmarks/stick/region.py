"""Stiffness and damping that a rendered head may have on a sampled arm: drumstick lab region.

For an arm of 75 g in a loose hand, at several rates, delays and with or without prediction: between
which R_in the envelope accepts each K_coll, and which rule ends the range below and above; how much of the table's
range that was accepted before 2026-11-23, when there was no rule above, is refused now; and what the very tick that
plays makes of sets all over that range, in virtual time, without friction and without the guard's passivity control,
judged by tests/arm_witness.py at the lightest, the nominal and the heaviest arm that the envelope reckons with. Of the
accepted ones some hundred more are played at random, half of them near the stiffest, with masses at random.
Besides, the largest R_in over the mass of the arm. Results go to lab/results/region.json.
"""

import json
import math
from typing import Any, NamedTuple

import numpy as np

import arm_witness
import held_arms
import live_sets
from drumstick.parameters.stick import Stick
from drumstick.safety import envelope, sampled_contact
from drumstick.stick.law import law_of
from drumstick_lab.measuring import stored
from haptic_server.limits import lag_s, limits_of
from haptic_server.servo.device.simulated import Simulated, specification_of

HAND = Stick(
    m_kg=0.075,
    k_coll_N_per_m=3500.0,
    k_hand_N_per_m=60.0,
    r_out_N_s_per_m=0.5,
    z_ss_m=-0.01,
    release="unilateral",
)
K_N_PER_M = (50.0, HAND.k_coll_N_per_m)
R_N_S_PER_M = (0.05, 1000.0)
RULES = {
    envelope.OK: "accepted", envelope.LATE: "late", envelope.SELF_DRIVEN: "self-driven", envelope.COUNT_LIMIT_CYCLE: "coarse",
    envelope.COUNT_OSCILLATION: "fine",
}  # fmt: skip
STIFFNESSES, DAMPINGS, HALVINGS = 81, np.geomspace(*R_N_S_PER_M, 241), 6  # of the judged grid
ACCEPTED_BEFORE = ("accepted", "rebound", "self-driven", "coarse", "fine")
PLAYED_STIFFNESSES, PLAYED_DAMPINGS = 9, 30  # of the played one
MASSES_KG = np.geomspace(0.02, 0.5, 57)
SOUGHT, NEAR_THE_STIFFEST = 300, 0.8
PLAYED_S = 4.0  # ten time constants of the arm on its hand and more


class Setting(NamedTuple):
    """Sampling of the arm."""

    rate: int
    delay: int
    predictor: str


SETTINGS = (
    Setting(500, 0, "lead"),
    Setting(1000, 0, "lead"),
    Setting(2000, 0, "lead"),
    Setting(4000, 0, "lead"),
    Setting(1000, 0, "off"),
    Setting(1000, 1, "lead"),
    Setting(1000, 2, "lead"),
    Setting(4000, 4, "lead"),
)
OVER_MASS = tuple((setting, k) for setting in (SETTINGS[1], SETTINGS[5]) for k in (500.0, 3500.0))


def _rounded(value: Any) -> Any:
    if value is None or isinstance(value, bool | str | int):
        return value
    if isinstance(value, float):
        return float(f"{value:.4g}")
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    return [_rounded(one) for one in value] if isinstance(value, list | tuple) else value


def _lines(result: dict[str, Any]) -> str:
    return json.dumps(result).replace('{"k_coll"', '\n{"k_coll"').replace('{"rate"', '\n{"rate"')


def _values(setting: Setting, m: float) -> dict[str, Any]:
    return {
        "m": m, "k_hand": HAND.k_hand_N_per_m, "r_out": HAND.r_out_N_s_per_m, "z_ss": HAND.z_ss_m,
        "release": HAND.release, "friction": 0.0, **setting._asdict(),
    }  # fmt: skip


class Judge:
    """The envelope's code for K_coll and R_in on one arm."""

    def __init__(self, setting: Setting, m: float) -> None:
        scene = held_arms.scene_of(**_values(setting, m))
        self._law = law_of(scene)
        self._limits = limits_of(scene, Simulated(scene).info().specification).record()
        self._room = envelope.new_scratch()
        self.lag_s = lag_s(scene)
        self.masses_kg = specification_of(scene).moving_kg

    def rule(self, k: float, r: float) -> str:
        """Rule that refuses the set, or `accepted`."""
        self._law["k_coll"], self._law["r_in"] = k, r
        code = envelope.judge(self._law[0], self._limits[0], self._room).code
        if code == envelope.SELF_DRIVEN and self._has_stable_poles(k, r):
            return "rebound"
        return RULES.get(code, "other")

    def _has_stable_poles(self, k: float, r: float) -> bool:
        # With the plain difference for its speed. If so, it is the rebound of a blow that refuses the set.
        limits = self._limits[0]
        head = sampled_contact.Head(k, r - HAND.r_out_N_s_per_m, int(self._law["release"][0]))
        rest = (0.0, float(limits["period_s"]), int(limits["delay_ticks"]), float(limits["lead_s"]))
        return all(
            sampled_contact.is_stable(sampled_contact.Arm(m, grip, *rest), head, 1, self._room)
            for m in self.masses_kg
            for grip in (0.0, HAND.k_hand_N_per_m)
        )

    def largest(self, k: float) -> float | None:
        """The largest R_in that is accepted, N s/m."""
        accepted = [band["to"] for band in self.bands(k) if band["rule"] == "accepted"]
        return accepted[-1] if accepted else None

    def _edge(self, k: float, low: float, high: float, below: str) -> float:
        # Between two neighbours on the grid of R_in: where the rule `below` ends.
        for _ in range(HALVINGS):
            middle = math.sqrt(low * high)
            if self.rule(k, middle) == below:
                low = middle
            else:
                high = middle
        return math.sqrt(low * high)

    def bands(self, k: float) -> list[dict[str, Any]]:
        """Verdicts on R_in at one stiffness, from the least up: from .. to, N s/m, and the rule."""
        found: list[dict[str, Any]] = []
        low, since, words = float(DAMPINGS[0]), float(DAMPINGS[0]), self.rule(k, float(DAMPINGS[0]))
        for high in DAMPINGS[1:].tolist():
            rule = self.rule(k, high)
            if rule != words:
                edge = self._edge(k, low, high, words)
                found.append({"rule": words, "from": since, "to": edge})
                since, words = edge, rule
            low = high
        return [*found, {"rule": words, "from": since, "to": low}]


def played(setting: Setting, arm_kg: float, k: float, r: float) -> arm_witness.Verdict:
    """One set on an arm of `arm_kg`, without the guard's passivity control."""
    scene = held_arms.scene_of(k=k, r=r, **_values(setting, HAND.m_kg))
    servo = live_sets.servo_of(scene)
    servo.guard["max_added_speed"] = 1e3
    servo.plant["m_kg"] = arm_kg
    return arm_witness.held(servo, PLAYED_S)


def _points(setting: Setting, judge: Judge) -> list[dict[str, Any]]:
    # Middles of cells; every other column half a cell up, so that boundaries are met at more heights.
    rows: list[dict[str, Any]] = []
    low, high = np.log(K_N_PER_M), np.log(R_N_S_PER_M)
    masses = (judge.masses_kg[0], HAND.m_kg, judge.masses_kg[1])
    for column in range(PLAYED_STIFFNESSES):
        k = math.exp(low[0] + (column + 0.5) / PLAYED_STIFFNESSES * (low[1] - low[0]))
        for row in range(PLAYED_DAMPINGS):
            at = (row + (0.25 if column % 2 == 0 else 0.75)) / PLAYED_DAMPINGS
            r = math.exp(high[0] + at * (high[1] - high[0]))
            if r < HAND.r_out_N_s_per_m:
                continue
            verdicts = [played(setting, arm, k, r) for arm in masses]
            rows.append(
                {
                    "k_coll": k,
                    "r_in": r,
                    "rule": judge.rule(k, r),
                    "safe": all(one.safe and one.fault == 0 for one in verdicts),
                    "late_m_per_s": max(one.late_m_per_s for one in verdicts),
                    "fault": max(one.fault for one in verdicts),
                }
            )
    return rows


def _sought(setting: Setting, judge: Judge, stiffest: float) -> dict[str, Any]:
    # Accepted sets at random, half of them near the stiffest, each on three arms of random mass: is one unsafe?
    rng = np.random.default_rng(1)
    low, high = np.log(R_N_S_PER_M)
    unsafe: list[dict[str, Any]] = []
    sets, worst, grown = 0, 0.0, 0.0
    while sets < SOUGHT:
        least = NEAR_THE_STIFFEST * stiffest if sets % 2 else K_N_PER_M[0]
        k = math.exp(rng.uniform(math.log(least), math.log(stiffest)))
        r = math.exp(rng.uniform(low, high))
        if judge.rule(k, r) != "accepted":
            continue
        sets += 1
        for arm_kg in rng.uniform(*judge.masses_kg, 3):
            one = played(setting, float(arm_kg), k, r)
            worst, grown = max(worst, one.late_m_per_s), max(grown, one.grown_to_m_per_s)
            if not one.safe or one.fault != 0:
                unsafe.append({"k_coll": k, "r_in": r, "m": float(arm_kg), **one._asdict()})
    return {
        "sets": sets,
        "runs": 3 * sets,
        "unsafe": unsafe,
        "late_m_per_s": worst,
        "grown_to_m_per_s": grown,
    }


def _shares(columns: list[dict[str, Any]]) -> dict[str, float]:
    # Of the table's range, by logarithm of both; what the scene's R_out leaves out is not counted.
    total: dict[str, float] = {}
    for band in (band for column in columns for band in column["bands"]):
        total[band["rule"]] = total.get(band["rule"], 0.0) + math.log(band["to"] / band["from"])
    whole = len(columns) * math.log(R_N_S_PER_M[1] / R_N_S_PER_M[0])
    return {rule: length / whole for rule, length in total.items()}


def _plain(column: dict[str, Any]) -> dict[str, Any]:
    return column | {"bands": [[band["rule"], band["from"], band["to"]] for band in column["bands"]]}


def region(setting: Setting) -> dict[str, Any]:
    """One setting: what becomes of R_in over stiffness, the share that is refused now, and the points played."""
    judge = Judge(setting, HAND.m_kg)
    stiffnesses = np.geomspace(*K_N_PER_M, STIFFNESSES).tolist()
    columns = [{"k_coll": k, "late": k * judge.lag_s, "bands": judge.bands(k)} for k in stiffnesses]
    shares, points = _shares(columns), _points(setting, judge)
    # Before, nothing but lag was asked of damping: what is not late now was accepted.
    before = sum(shares.get(rule, 0.0) for rule in ACCEPTED_BEFORE)
    inside = [point for point in points if point["rule"] == "accepted"]
    beyond = [point for point in points if point["rule"] in ACCEPTED_BEFORE[1:]]
    stiffest = max(c["k_coll"] for c in columns if any(band["rule"] == "accepted" for band in c["bands"]))
    return {
        **setting._asdict(),
        "lag_s": judge.lag_s,
        "moving_kg": judge.masses_kg,
        "shares": shares,
        "refused_of_the_former": 1.0 - shares.get("accepted", 0.0) / before,
        "stiffest_accepted": stiffest,
        "sought": _sought(setting, judge, stiffest),
        "accepted_played": len(inside),
        "accepted_unsafe": sum(not point["safe"] for point in inside),
        "refused_now_played": len(beyond),
        "refused_now_safe": sum(point["safe"] for point in beyond),
        "columns": [_plain(column) for column in columns],
        "points": {name: [point[name] for point in points] for name in points[0]},
    }


def over_mass() -> list[dict[str, Any]]:
    """The largest accepted R_in over the arm's mass."""
    return [
        {
            **setting._asdict(),
            "k_coll": k,
            "m_kg": [float(m) for m in MASSES_KG],
            "largest": [Judge(setting, float(m)).largest(k) for m in MASSES_KG],
        }
        for setting, k in OVER_MASS
    ]


def main() -> None:
    result: dict[str, Any] = {
        "m_kg": HAND.m_kg,
        "k_hand_N_per_m": HAND.k_hand_N_per_m,
        "r_hand_N_s_per_m": HAND.r_out_N_s_per_m,
        "k_N_per_m": K_N_PER_M,
        "r_N_s_per_m": R_N_S_PER_M,
        "played_s": PLAYED_S,
        "most_rebound": sampled_contact.MAX_REBOUND,
        "most_kick_m_per_s": sampled_contact.MAX_VELOCITY_STEP_M_PER_S,
        "most_swing_m_per_s": sampled_contact.MAX_OSCILLATION_M_PER_S,
        "most_slow_rebound": sampled_contact.MAX_SLOW_REBOUND,
        "regions": [region(setting) for setting in SETTINGS],
        "over_mass": over_mass(),
    }
    for row in result["regions"]:
        print({name: value for name, value in row.items() if name not in ("columns", "points")})
    stored.store("region", _rounded(result), _lines)


if __name__ == "__main__":
    main()
