"""`drumstick analyse`: what the equations predict for a scene and what its exact motion does, in words or as JSON."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig import extras, scene_file
from rig.exit_status import usage_error

if TYPE_CHECKING:
    from drumstick.analysis.cycles.basins import Basin, Withstands
    from drumstick.analysis.cycles.cycle import Cycle
    from drumstick.analysis.cycles.sweep import Axis
    from drumstick.analysis.findings import Findings
    from drumstick.parameters.scene import Scene
    from drumstick.stick.effects.cor_pulse import CorPulse

_ENDS = {
    "captured": "it comes to rest in the head",
    "left": "it leaves: it never comes back, or its speed grows without end",
    "unsettled": "it bounces on without a period of up to 8 contacts",
}
_MOST_RANGES = 12


def analyse(
    scene: str,
    as_json: bool,
    out: Path | None = None,
    sweeps: Sequence[str] = (),
    rate_Hz: float | None = None,
    level: float | None = None,
) -> None:
    """Print the findings as a page of words or as one JSON object; with `out` write figures and tables there.

    sweeps: what --sweep was given. rate_Hz, level: of a roll that the scene is first changed to. Raises CommandError.
    """
    loaded, changed = _changed(scene_file.load(scene), rate_Hz, level)
    if sweeps and out is None:
        usage_error("--sweep writes a table and figures: say where with --out DIR")
    axes = _ready(loaded, out, sweeps) if out is not None else []
    from drumstick.analysis.findings import analyse as findings_of

    found = findings_of(loaded, scene_file.gesture(scene, loaded))
    written: list[str] = []
    if out is not None:
        from rig.figures.write import write

        written = write(loaded, found, out, axes, quiet=as_json)
    if as_json:
        print(json.dumps({**found.as_json(), **({"values": changed} if changed else {})}, allow_nan=False))
        return
    if changed:
        print("changed: " + ", ".join(f"{name} = {value:.6g}" for name, value in changed.items()) + "\n")
    print(words(loaded, found))
    if out is not None:
        print(f"\nwritten to {out}: {', '.join(written)}")


def _changed(scene: "Scene", rate_Hz: float | None, level: float | None) -> "tuple[Scene, dict[str, float]]":
    # The scene with a roll of this rate and level, and the values that make it; {} where none was asked for.
    if rate_Hz is None and level is None:
        return scene, {}
    if scene.hand_moves_stick:
        usage_error(f"--rate, --level: the hand of {scene.name} moves, so its roll has no one rate and level")
    from drumstick.analysis.inverse import Inverse, moved
    from drumstick.scenes.table import Refusal, scene_with
    from drumstick.stick.law import law_of

    try:
        inverse = Inverse(scene)
        values = moved(inverse.towards(inverse.present(law_of(scene)), rate_Hz, level).law)
    except Refusal as refusal:
        usage_error(str(refusal))
    return scene_with(scene, values), values


def _ready(scene: "Scene", out: Path, sweeps: Sequence[str]) -> "list[Axis]":
    # Everything that can be wrong with --out and --sweep is said before the long work begins.
    from rig.figures import requirements, sweep_option

    extras.require("--out", "figures")
    axes = sweep_option.axes(scene, sweeps)
    requirements.require_folder(out)
    return axes


def words(scene: "Scene", found: "Findings") -> str:
    """The findings as a page to read."""
    parts = [
        f"{scene.name}: {scene.words}" if scene.words else scene.name,
        *([] if found.note is None else [found.note]),
        "",
        *_contact(scene, found),
        "",
        *_speeds(scene, found),
        *_equation_8(scene, found),
        "",
        *_effective(found),
        "",
        *_cycles(scene, found),
        *_two_hands(scene, found),
        *_grips(scene, found),
    ]
    return "\n".join(parts)


def _two_hands(scene: "Scene", found: "Findings") -> list[str]:
    work = found.hand_work
    if work is None:
        return []
    hands = ", ".join(f"{1e3 * watts:.3g} mW" for watts in work.hands_W)
    return [
        "",
        f"two hands, each with a stick of its own (what stands above is one stick that is thrown, in a hand that holds "
        f"still): {work.rate_Hz:.2f} strikes a second of {work.strike_m_per_s:.3g} m/s",
        f"  variation of the intervals {work.interval_variation:.3f}, of the speeds {work.speed_variation:.3f}",
        f"  the hands give {hands}; the drum gives {1e3 * work.drum_W:.3g} mW",
    ]


def _grips(scene: "Scene", found: "Findings") -> list[str]:
    if not found.grips:
        return []
    rows = (
        f"  {grip.t_s:8.3f} {grip.k_hand_N_per_m:11.4g} {grip.r_out_N_s_per_m:12.4g} {1e3 * grip.z_ss_m:9.3g}"
        f" {_number(grip.rate_Hz):>9s} {_number(grip.v_e_m_per_s):>10s}"
        for grip in found.grips
    )
    return [
        "",
        f"the hand moves, as {scene.hand.gesture_file} has it (what stands above is the grip of [stick], held still); "
        "each grip, if it stayed:",
        "       t s   K_hand N/m  R_out N s/m   z_ss mm   rate Hz    v_E m/s",
        *rows,
        "  as it moves, the roll is some strikes behind this",
    ]


def _number(value: float | None, unit: str = "") -> str:
    return "none" if value is None else f"{value:.6g}{' ' + unit if unit else ''}"


def _contact(scene: "Scene", found: "Findings") -> list[str]:
    whose = "of the roll" if found.primary is not None else f"at {scene.hand.throw_m_per_s:g} m/s, the throw"
    lines = [
        f"beta   {_number(found.beta_eq3):>12s}   restitution by equation (3)"
        + (": overdamped, it has no value" if found.overdamped else ""),
        f"       {_number(found.beta_measured):>12s}   measured, {whose}"
        + ("" if found.beta_measured is not None else ": without a pulse such a contact never ends"),
        f"alpha  {_number(found.alpha):>12s}   soft collision with the hand, {whose}"
        + ("" if found.alpha is not None else ": the stick never comes back"),
    ]
    if found.kappa is not None:
        lines.append(f"kappa  {found.kappa:12.6g}   v_E = beta |v_in| + kappa dv, for a small pulse")
    if found.capture_speed_m_per_s is not None:
        lines.append(
            f"dead below {found.capture_speed_m_per_s:.4g} m/s: a slower contact without a pulse ends at rest in the "
            "head; lift the stick to re-arm"
        )
    return lines


def _speeds(scene: "Scene", found: "Findings") -> list[str]:
    if "pulse" not in scene.effects:
        return ["no pulse: equation (7) has nothing to say"]
    measured = None if found.primary is None else found.cycles[found.primary].v_e_m_per_s
    lines = [
        "speed of the roll, v_lc:",
        f"  equation (7), as printed     {_number(found.v_lc_eq7_m_per_s, 'm/s')}",
        f"  with the pulse's own kappa   {_number(found.v_lc_kappa_m_per_s, 'm/s')}{_thrown_back(found)}",
        f"  exact motion                 {_number(measured, 'm/s')}",
    ]
    sentence = _why_not_equation_7(scene, found)
    return [*lines, sentence] if sentence else lines


def _equation_8(scene: "Scene", found: "Findings") -> list[str]:
    added: CorPulse | None = scene.effects.get("cor_pulse")
    if added is None:
        return []
    lines = [
        f"equation (8): alpha (beta + gamma), 1 where a speed is kept, with gamma = {added.gamma:g}",
        "       v_E m/s       alpha        beta   marginal gamma   alpha (beta + gamma)   beta^ played",
    ]
    for cycle, by_8 in zip(found.cycles, found.equation_8, strict=True):
        numbers = (by_8.alpha, by_8.beta, by_8.marginal_gamma, by_8.factor, by_8.effective_beta)
        cells = (
            f"{_number(number):>{width}}" for number, width in zip(numbers, (11, 11, 16, 22, 14), strict=True)
        )
        lines.append(f"  {cycle.v_e_m_per_s:12.6f} {' '.join(cells)}")
    if not found.cycles and found.alpha is not None and found.beta_measured is not None:
        factor = found.alpha * (found.beta_measured + added.gamma)
        lines[1:] = [f"  {factor:.4g} at the throw's speed"]
    if found.beta_without_hand is not None and found.beta_eq3 is not None:
        limit = found.beta_eq3 + added.gamma
        lines.append(
            f"  without a hand beta^ is {found.beta_without_hand:.5g}, {found.beta_without_hand - limit:+.2g} beside "
            f"beta + gamma = {limit:.5g}, which a quick push of gamma |v_in|/beta into the drum at contact comes to"
        )
    return [
        *lines,
        "  alpha falls with the speed: hence a roll can settle, which one alpha for all speeds rules out",
    ]


def _effective(found: "Findings") -> list[str]:
    from drumstick.analysis.effective import SPEEDS_M_PER_S

    cells = (
        f"{speed:g}: {'stays' if beta is None else f'{beta:.3f}'}"
        for speed, beta in zip(SPEEDS_M_PER_S, found.effective, strict=True)
    )
    return [
        "beta^, what a blow is given back with all effects, by its speed in m/s:",
        "  " + ", ".join(cells),
    ]


def _thrown_back(found: "Findings") -> str:
    if found.kappa is None or found.kappa > 0.0 or found.v_lc_kappa_m_per_s is None:
        return ""
    return "   dv/(1 + alpha): the pulse throws the stick back before it compresses the head"


def _why_not_equation_7(scene: "Scene", found: "Findings") -> str:
    pulse = scene.effects["pulse"]
    if found.beta_eq3 is None or found.kappa is None:
        return ""
    if abs(found.kappa - found.beta_eq3) <= 0.02:
        return ""
    way = "up, away from the head" if pulse.sign > 0 else "down, into the head"
    moment = {"entry": "at contact", "turn": "at the deepest point", "exit": "at release"}[pulse.trigger]
    return (
        f"  Equation (7) takes kappa = beta, which a quick pulse into the head at contact has. "
        f"This pulse pushes {way}, {moment}: kappa = {found.kappa:.3g}."
    )


def _cycles(scene: "Scene", found: "Findings") -> list[str]:
    if found.throw_ends is None:
        return ["no cycles"]
    lines = ["no cycle: no roll, at any speed"]
    if found.cycles:
        lines = ["       v_E m/s     rate Hz   apex mm  contact ms   multiplier"]
        lines += [_row(cycle, index == found.primary) for index, cycle in enumerate(found.cycles)]
    lines += ["", *_ends(found), ""]
    throw = f"thrown at {scene.hand.throw_m_per_s:g} m/s "
    if found.throw_ends != "cycle":
        return [*lines, throw + _ENDS[found.throw_ends]]
    assert found.primary is not None
    roll = found.cycles[found.primary]
    if roll.period == 1:
        return [*lines, throw + f"it rolls at {roll.rate_Hz:.2f} Hz"]
    return [*lines, throw + f"it repeats every {roll.period} contacts, {roll.rate_Hz:.2f} contacts a second"]


def _ends(found: "Findings") -> list[str]:
    # Which strike leads where, and what breaks a roll.
    if found.ends is None:
        return []
    ranges, count = found.ends.basins, found.ends.count
    many = "one stable end" if count == 1 else f"{count} stable ends"
    lines = [f"{many}, by the speed of the first strike, up to {ranges[-1].to_m_per_s:.4g} m/s:"]
    for index, basin in enumerate(ranges[:_MOST_RANGES]):
        lines.append(f"  {_range(basin, index == 0, index == len(ranges) - 1):30s} {_end(basin)}")
    if len(ranges) > _MOST_RANGES:
        lines.append(f"  and {len(ranges) - _MOST_RANGES} more; --json has them all")
    if count > 1:
        lines.append(
            "warning: more than one stable end: a strike that is too soft or too hard can lead to another one"
        )
    return [*lines, *(_limits(limits) for limits in found.ends.withstands)]


def _range(basin: "Basin", first: bool, last: bool) -> str:
    low, high = f"{basin.from_m_per_s:.6g}", f"{basin.to_m_per_s:.6g}"
    if first:
        return "any" if last else f"below {high} m/s"
    return f"above {low} m/s" if last else f"{low} .. {high} m/s"


def _end(basin: "Basin") -> str:
    if basin.cycle is None:
        return _ENDS[basin.end]
    return f"it rolls at {basin.cycle.rate_Hz:.2f} Hz, v_E {basin.cycle.v_e_m_per_s:.4g} m/s"


def _limits(limits: "Withstands") -> str:
    roll = f"the roll at {limits.cycle.rate_Hz:.2f} Hz, strikes of {limits.strike_m_per_s:.4g} m/s, "
    if limits.least_m_per_s is None:
        return roll + "comes back after any single strike"
    softer, harder = limits.slowest_m_per_s, limits.fastest_m_per_s
    outside = [f"below {softer:.4g}"] if softer is not None else []
    outside += [f"above {harder:.4g}"] if harder is not None else []
    return f"{roll}is broken by a strike {' or '.join(outside)} m/s: {limits.least_m_per_s:.3g} m/s off"


def _row(cycle: "Cycle", primary: bool) -> str:
    kind = "stable" if cycle.stable else "unstable"
    period = "" if cycle.period == 1 else f", every {cycle.period} contacts"
    return (
        f"  {'>' if primary else ' '} {cycle.v_e_m_per_s:10.6f} {cycle.rate_Hz:11.4f} {cycle.apex_m * 1e3:9.4f}"
        f" {cycle.contact_s * 1e3:11.4f} {cycle.multiplier:12.6f}  {kind}{period}"
    )
