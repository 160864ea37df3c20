"""Writes docs/stick.md and its pictures from the code: drumstick lab stick-page.

The words are in stick.template.md, every number among them is computed here; pictures are drawn only where they are not
up to date (stick_pictures.py).
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drumstick.analysis.cycles.grips import grips_at
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import Settled, settle
from drumstick.analysis.cycles.sweep import BUZZ_HZ
from drumstick.analysis.findings import Findings, analyse
from drumstick.analysis.flight import flight
from drumstick.analysis.gain import gain
from drumstick.analysis.hand_work import hand_work
from drumstick.analysis.rebound import rebound
from drumstick.analysis.steadying import Drummer, held_s
from drumstick.parameters.scene import Scene
from drumstick.scenes.gesture import REACTION_S, stick_gesture
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick import contact, moving_hand
from drumstick.stick.law import law_of
from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import line
from drumstick_lab.measuring.stored import read

PAGE = DOCS / "stick.md"
TEMPLATE = Path(__file__).parent / "stick.template.md"

ROLL, PAPER, COR, LITERAL, PHANTOM, DOUBLE, GRIP = (
    parse(shipped_text(name), name)
    for name in ("roll", "paper-roll", "cor-roll", "cor-literal", "phantom", "double-stroke", "grip")
)
_QUICK_S = 1e-5
_TAUS_S = (1e-5, 5e-4, 1e-3, 2e-3, 5e-3, 2e-2, 1e-1)
_SPEEDS_M_PER_S = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_WHEN = {"entry": "at contact", "turn": "at the deepest point", "exit": "at release"}


def stale_pictures() -> list[str]:
    """Names of pictures that are missing or were made from something else than the code says now."""
    from drumstick_lab.pages import stick_pictures

    return [picture.name for picture in stick_pictures.stale()]


def _pulsed(**changes: Any) -> Scene:
    return replace(ROLL, effects={"pulse": replace(ROLL.effects["pulse"], **changes)})


def _number(value: float | None, digits: int = 3) -> str:
    return "none" if value is None else f"{value:.{digits}f}"


def _ends(found: Findings) -> str:
    if found.throw_ends == "captured":
        return "rests in the head"
    assert found.primary is not None
    roll = found.cycles[found.primary]
    if roll.period > 1:
        return f"buzzes: {roll.period} unequal strikes in turn, {roll.rate_Hz:.0f} Hz"
    buzz = "buzzes" if roll.rate_Hz >= BUZZ_HZ else "rolls"
    return f"{buzz} at {roll.rate_Hz:.1f} Hz, multiplier {roll.multiplier:+.2f}"


def _case(words: str, scene: Scene) -> str:
    pulse, found = scene.effects["pulse"], analyse(scene)
    exact = None if found.primary is None else found.cycles[found.primary].v_e_m_per_s
    way = "up" if pulse.sign > 0 else "into the head"
    return (
        f"| {words} | {_WHEN[pulse.trigger]}, {way} | {pulse.dv_m_per_s:g} | {pulse.tau_s * 1e3:g} | {_number(found.kappa, 2)} |"
        f" {_number(found.v_lc_eq7_m_per_s)} | {_number(found.v_lc_kappa_m_per_s)} | **{_number(exact)}** | {_ends(found)} |"
    )


def _three_numbers() -> list[str]:
    return [
        "| | pulse | Δv m/s | τ ms | κ | equation (7) m/s | with κ m/s | exact m/s | a throw at "
        f"{ROLL.hand.throw_m_per_s:g} m/s |",
        "|---|---|---|---|---|---|---|---|---|",
        _case("what (7) describes", _pulsed(trigger="entry", sign=-1, tau_s=_QUICK_S)),
        _case("the same, slower", _pulsed(trigger="entry", sign=-1)),
        _case("the text, quick", _pulsed(trigger="entry", sign=1, tau_s=_QUICK_S)),
        _case("the text", _pulsed(trigger="entry", sign=1)),
        _case("the text, `paper-roll`", PAPER),
        _case("the text, τ long", _pulsed(trigger="entry", sign=1, tau_s=2e-2)),
        _case("half-way", _pulsed(trigger="turn", sign=1)),
        _case("`roll`, the default", ROLL),
        _case("`phantom`, a heavier stick", PHANTOM),
    ]


def _gains() -> list[str]:
    stick = ROLL.stick
    rows = [
        "| τ ms | up, at contact | into the head, at contact | up, at the deepest point | up, at release |",
        "|---|---|---|---|---|",
    ]
    for tau_s in _TAUS_S:
        kinds = (("entry", 1), ("entry", -1), ("turn", 1), ("exit", 1))
        cells = " | ".join(f"{gain(stick, trigger, sign, tau_s):+.2f}" for trigger, sign in kinds)
        rows.append(f"| {tau_s * 1e3:g} | {cells} |")
    return rows


def _alphas() -> list[str]:
    rows = ["| speed m/s | α | β | height mm | flight ms | contact ms |", "|---|---|---|---|---|---|"]
    for speed in _SPEEDS_M_PER_S:
        flown, struck = flight(ROLL, speed), rebound(ROLL, speed)
        assert flown is not None
        back = (
            (f"{struck.beta:.3f}", f"{struck.contact_s * 1e3:.2f}")
            if struck
            else ("stays in the head", "no end")
        )
        rows.append(
            f"| {speed:g} | {flown.alpha:.3f} | {back[0]} | {flown.apex_m * 1e3:.2f} | {flown.duration_s * 1e3:.1f} | {back[1]} |"
        )
    return rows


def _by_equation_8(found: Findings) -> list[str]:
    rows = [
        "| v_E m/s | | α | β | marginal γ | α (β + γ) | played: α β^ |",
        "|---|---|---|---|---|---|---|",
    ]
    for cycle, by_8 in zip(found.cycles, found.equation_8, strict=True):
        assert by_8.alpha is not None
        assert by_8.effective_beta is not None
        kept = by_8.alpha * by_8.effective_beta
        numbers = (by_8.alpha, by_8.beta, by_8.marginal_gamma, by_8.factor, kept)
        kind = "stable" if cycle.stable else "unstable"
        rows.append(
            f"| {cycle.v_e_m_per_s:.3f} | {kind} | {' | '.join(_number(number, 4) for number in numbers)} |"
        )
    return rows


def _hands() -> list[str]:
    rows = [
        "| scene | strikes a second | mean strike m/s | variation of the intervals | of the speeds | each hand gives mW | the drum gives mW |",
        "|---|---|---|---|---|---|---|",
    ]
    for scene in (DOUBLE, ROLL):
        found = hand_work(scene)
        hands = " and ".join(f"{1e3 * watts:.1f}" for watts in found.hands_W)
        rows.append(
            f"| `{scene.name}` | {found.rate_Hz:.1f} | {found.strike_m_per_s:.2f} | {100.0 * found.interval_variation:.1f} % |"
            f" {100.0 * found.speed_variation:.1f} % | {hands} | {1e3 * found.drum_W:.1f} |"
        )
    return rows


def _grip() -> dict[str, Any]:
    # How the roll of `grip` follows its hand: slowly up to where its last squeeze begins, then quickly.
    gesture = stick_gesture(GRIP, None)
    assert gesture is not None
    length_s, squeeze_s = float(gesture[-1, 0]), float(gesture[5, 0])
    live, fine = (
        moving_hand.play(GRIP, gesture, length_s, GRIP.hand.throw_m_per_s, tick_s=tick_s).contacts
        for tick_s in (1e-3, 1e-3 / 64.0)
    )
    begins = live[:, 0]
    times, rates = 0.5 * (begins[1:] + begins[:-1]), 1.0 / np.diff(begins)
    still = np.array([grip.rate_Hz for grip in grips_at(GRIP, gesture, times)])
    off = np.abs(rates / still - 1.0)
    slow = (begins[:-1] > gesture[1, 0]) & (begins[1:] < squeeze_s)
    quick = (begins[:-1] > squeeze_s) & (begins[1:] < gesture[7, 0])
    late = begins[1:][quick][off[quick] > 0.02]
    return {
        "grip_dv": GRIP.effects["pulse"].dv_m_per_s,
        "grip_off": float(off[slow].max()),
        "grip_low": float(rates[slow].min()),
        "grip_high": float(rates[slow].max()),
        "reaction_ms": 1e3 * REACTION_S,
        "grip_late": float(off[quick].max()),
        "grip_settled_s": float(late.max()) - squeeze_s,
        "grip_time_us": 1e6 * float(np.abs(live[:, 0] - fine[:, 0]).max()),
        "grip_speed": float(np.abs(live[:, 1] / fine[:, 1] - 1.0).max()),
    }


def _drummers(stored: dict[str, Any]) -> list[str]:
    lines = [
        "| surface | strokes a second | blocks | drummers | `interval_percent` | neighbours | `level_dB` |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in stored["rows"]:
        cells = (
            f"{middle:{form}} ({low:{form}} .. {high:{form}})"
            for form, (low, middle, high) in (
                (".1f", row["interval_percent"]),
                ("+.1f", row["neighbours"]),
                (".1f", row["velocity_dB"]),
            )
        )
        lines.append(
            f"| {row['surface']} | {row['from_Hz']:g} .. {row['to_Hz']:g} | {row['blocks']} | {row['drummers']} | {' | '.join(cells)} |"
        )
    return lines


def _boundary(scene: Scene, low: float, high: float, good: Callable[[Settled], bool]) -> float:
    """The dv in m/s from which on what a throw ends in is `good`, to four digits."""
    while high / low > 1.0001:
        middle = float(np.sqrt(low * high))
        changed = replace(scene, effects={"pulse": replace(scene.effects["pulse"], dv_m_per_s=middle)})
        ends = settle(law_of(changed), scratch_of(changed), scene.hand.throw_m_per_s)
        low, high = (low, middle) if good(ends) else (middle, high)
    return high


def _plays(ends: Settled) -> bool:
    return ends.end != "captured"


def _evenly(ends: Settled) -> bool:
    return ends.cycle is not None and ends.cycle.period == 1


def page() -> str:
    """The whole page."""
    roll, cor, literal, stick = analyse(ROLL), analyse(COR), analyse(LITERAL), ROLL.stick
    quick = analyse(_pulsed(trigger="entry", sign=-1, tau_s=_QUICK_S))
    added = ROLL.effects["pulse"].dv_m_per_s
    struck = rebound(ROLL, added - quick.cycles[0].v_in_m_per_s)  # the quick pulse adds to the blow
    assert struck is not None
    assert quick.alpha is not None
    contact_s = contact.contact_time(contact.PAPER, stick.m_kg, stick.k_coll_N_per_m, stick.r_in_N_s_per_m)
    weak, strong = cor.cycles
    assert roll.capture_speed_m_per_s is not None
    assert quick.v_lc_eq7_m_per_s is not None
    assert weak.v_e_m_per_s < strong.v_e_m_per_s
    assert (weak.stable, strong.stable) == (False, True)
    added_cor = LITERAL.effects["cor_pulse"]
    assert literal.beta_eq3 is not None
    assert literal.beta_without_hand is not None
    limit = literal.beta_eq3 + added_cor.gamma
    drummers = read("evenness")
    return TEMPLATE.read_text(encoding="utf-8").format(
        three_numbers="\n".join(_three_numbers()),
        gains="\n".join(_gains()),
        alphas="\n".join(_alphas()),
        eq7_over_exact=quick.v_lc_eq7_m_per_s / quick.cycles[0].v_e_m_per_s - 1.0,
        beta_eq3=roll.beta_eq3,
        beta=struck.beta,
        eq7_with_beta=struck.beta * added / (1.0 - quick.alpha * struck.beta),
        exact_quick=quick.cycles[0].v_e_m_per_s,
        contact_ms=contact_s * 1e3,
        capture=roll.capture_speed_m_per_s,
        rest_s=ROLL.hand.rest_s,
        roll_dies=_boundary(ROLL, 0.02, 0.2, _plays),
        paper_dies=_boundary(PAPER, 0.05, 1.0, _plays),
        paper_buzzes=_boundary(PAPER, 0.19, 1.0, _evenly),
        buzz_Hz=BUZZ_HZ,
        gamma=COR.effects["cor_pulse"].gamma,
        weak=weak,
        literal=literal.cycles[1],
        literal_weak=literal.cycles[0],
        literal_gamma=added_cor.gamma,
        literal_tau_ms=added_cor.tau_s * 1e3,
        literal_beta=literal.beta_without_hand,
        literal_limit=limit,
        literal_missed=literal.beta_without_hand - limit,
        equation_8="\n".join(_by_equation_8(literal)),
        strong=strong,
        hands="\n".join(_hands()),
        period_s=DOUBLE.hand.gesture_period_s,
        **_grip(),
        drummers_block=drummers["intervals_a_block"] + 1,
        drummers_line=line("evenness"),
        drummers="\n".join(_drummers(drummers)),
        alone_s=[held_s(COR, weak, Drummer(0.0, 0.0, 0.0), 0, off=off) for off in (0.01, -0.01)],
        roll=roll.cycles[0],
        roll_apex_mm=roll.cycles[0].apex_m * 1e3,
        dv=added,
        paper_dv=PAPER.effects["pulse"].dv_m_per_s,
    )


if __name__ == "__main__":
    from drumstick_lab.pages import stick_pictures

    for picture in stick_pictures.stale():
        print(picture.name)
        stick_pictures.write(picture)
    PAGE.write_text(page(), encoding="utf-8")
