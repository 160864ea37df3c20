"""The section of docs/servo.md about the arm that stays in the head, and its picture."""

import math
from typing import Any

from drumstick.safety import sampled_contact
from drumstick_lab.checkout import DOCS
from drumstick_lab.guard_version import guard_version, is_of_this_guard
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read

PICTURE = DOCS / "images" / "servo-region.png"
SLOW_M_PER_S = 0.01  # as in tests/arm_witness.py
NEW_RULES = ("rebound", "coarse", "fine", "self-driven")
REFUSED = "#f6dcd0"
LATE, COUNTS, BACK = (0, (4, 2)), (0, (5, 1.5, 1, 1.5)), (0, (1.2, 1.2))  # dashes


def _setting(row: dict[str, Any]) -> str:
    delay = {0: "no delay", 1: "1 tick late"}.get(row["delay"], f"{row['delay']} ticks late")
    return f"{row['rate']} Hz, {delay}" + ("" if row["predictor"] == "lead" else ", no prediction")


def _row(region: dict[str, Any]) -> str:
    shares = region["shares"]
    before = shares["accepted"] + sum(shares.get(rule, 0.0) for rule in NEW_RULES)
    cells = (
        _setting(region),
        f"{region['refused_of_the_former']:.0%}",
        f"{shares.get('self-driven', 0.0) / before:.0%}",
        f"{(shares.get('coarse', 0.0) + shares.get('fine', 0.0)) / before:.0%}",
        f"{shares.get('rebound', 0.0) / before:.0%}",
        f"{region['stiffest_accepted']:.0f}",
        f"{region['accepted_unsafe']} of {region['accepted_played']}",
        f"{len(region['sought']['unsafe'])} of {region['sought']['runs']}",
        f"{1e3 * region['sought']['late_m_per_s']:.1f}",
        f"{region['refused_now_safe']} of {region['refused_now_played']}",
    )
    return f"| {' | '.join(cells)} |"


def _first_that_moves(region: dict[str, Any]) -> list[tuple[float, float]]:
    # Over each stiffness played: the least R_in above the accepted ones at which the simulated arm moved by itself,
    # over the largest accepted; and its speed at the end.
    points = region["points"]
    found: dict[float, tuple[float, float]] = {}
    for at, k in enumerate(points["k_coll"]):
        near = min(region["columns"], key=lambda column: abs(math.log(column["k_coll"] / k)))
        good = [to for rule, _, to in near["bands"] if rule == "accepted"]
        if good and not points["safe"][at] and points["r_in"][at] > good[-1]:
            found.setdefault(k, (points["r_in"][at] / good[-1], points["late_m_per_s"][at]))
    return list(found.values())


def _beyond_rest(regions: list[dict[str, Any]]) -> list[str]:
    # What the accepted sets at random showed.
    runs = sum(region["sought"]["runs"] for region in regions)
    unsafe = [row for region in regions for row in region["sought"]["unsafe"]]
    if not unsafe:
        return [
            f"In none of the {runs} random runs did the arm move faster than {1e3 * SLOW_M_PER_S:g} mm/s at the end, enter the head faster than at the contact before, or end in a fault."
        ]
    fastest = 1e3 * max(row["late_m_per_s"] for row in unsafe)
    grew = sum(row["grown_to_m_per_s"] > 0.0 for row in unsafe)
    words = (
        "in none did the arm enter the head faster than at the contact before"
        if grew == 0
        else f"in {grew} it entered the head faster than at the contact before"
    )
    return [
        f"The region is no proof: in {len(unsafe)} of the {runs} random runs the arm was not at rest at the end, at {fastest:.1f} mm/s at most; {words}, and"
        f" {sum(row['fault'] != 0 for row in unsafe) or 'none'}",
        f"ended in a fault. They had {min(r['k_coll'] for r in unsafe):.0f} N/m and more, and arms of {1e3 * max(r['m'] for r in unsafe):.0f} g and less. All of that without friction.",
    ]


def _known(held: dict[str, Any]) -> list[str]:
    # The sets that once hammered: before, and under the guard alone.
    before = {row["case"]: row["verdict"] for row in held.get("before", {}).get("rows", [])}
    if not held.get("known"):
        return []
    lines = [
        f"Sets that the envelope once accepted and that kept themselves moving under the guard of that time (commit {held.get('before', {}).get('commit', 'unknown')});"
        f" and what {_whose(held)} does with them",
        "when the envelope is bypassed. K_coll 3500 N/m, 1 kHz and friction 0.04 N where nothing else is said; the hand presses the arm into the head.",
        "",
        "| set | before: largest entry speed above the one before it, m/s | before: speed at the end, m/s | guard alone now: largest entry speed above the one before it, m/s"
        " | guard alone now: speed at the end, m/s | envelope now |",
        "|---|---|---|---|---|---|",
    ]
    for row in held["known"]:
        cells = [_case(row)]
        for verdict in (before.get(row["case"]), row["guard_alone"]):
            if verdict is None:
                cells += ["-", "-"]
            else:
                cells += [f"{verdict['grown_to_m_per_s']:.3f}", f"{verdict['late_m_per_s']:.3f}"]
        lines.append(f"| {' | '.join([*cells, 'refused' if row['refused'] else 'accepted'])} |")
    return [*lines, ""]


def _case(row: dict[str, Any]) -> str:
    return row["case"] + (f", R_in {row['r']:g} N s/m" if "r" in row else "")


def _whose(result: dict[str, Any]) -> str:
    return "today's guard" if is_of_this_guard(result) else "an older guard than today's"


def _old(search: dict[str, Any]) -> list[str]:
    if is_of_this_guard(search):
        return []
    return [
        f"**Out of date:** this search was made with an older guard (begun {search.get('date', 'on an unknown day')}, SHA-256"
        f" {search.get('guard', 'unknown')}); today's ({guard_version()}) has not been searched yet."
    ]


def _search(held: dict[str, Any]) -> list[str]:
    search = held.get("search")
    if not search:
        return []
    unsafe = len(search["unsafe"])
    words = f"None of them moved faster than {1e3 * SLOW_M_PER_S:g} mm/s at the end, or entered the head faster than at the contact before"
    if unsafe:
        words = f"Unsafe: {unsafe}, which still moved at the end or entered the head faster than at the contact before"
    return [
        "`drumstick lab held-arm` draws sets at random, over masses, hands, rates, delays, friction and both kinds of release."
        f" {search['sets']} that the envelope accepts were",
        f"played, {search['within_2_percent_of_the_boundary']} of them within 2 % of where it refuses, half of all without the guard's passivity control. {words}.",
        f"The fastest arm at the end: {1e3 * search['worst_late_m_per_s']:.1f} mm/s; the fastest entry then: {1e3 * search['worst_late_entry_m_per_s']:.1f} mm/s.",
        *_old(search),
        "",
    ]


def _require_numbers_of_the_code(result: dict[str, Any]) -> None:
    now = {
        "most_rebound": sampled_contact.MAX_REBOUND,
        "most_kick_m_per_s": sampled_contact.MAX_VELOCITY_STEP_M_PER_S,
        "most_swing_m_per_s": sampled_contact.MAX_OSCILLATION_M_PER_S,
        "most_slow_rebound": sampled_contact.MAX_SLOW_REBOUND,
    }
    if any(result[name] != number for name, number in now.items()):
        raise LookupError("the region was judged by other numbers: drumstick lab region")


def section() -> list[str]:
    """Its lines."""
    result, held = read("region"), read("held_arm")
    _require_numbers_of_the_code(result)
    regions = result["regions"]
    light, heavy = (1e3 * m for m in regions[0]["moving_kg"])
    nominal, slow = 1e3 * result["m_kg"], 1e3 * SLOW_M_PER_S
    first = [one for region in regions for one in _first_that_moves(region)]
    ratios, speeds = [ratio for ratio, _ in first], [1e3 * speed for _, speed in first]
    (k_low, k_high), (r_low, r_high) = result["k_N_per_m"], result["r_N_s_per_m"]
    return [
        *heading("## When an arm that stays in the head comes to rest", "region", "held_arm"),
        "A rendered damper comes late too. Its force answers the speed of a while ago and is held for a tick; with too much of it the",
        "force outlives the motion and throws the arm back. So R_in has a largest value as well as a least one.",
        "",
        "The force F is held constant between ticks. With the mass m and the hand's spring and damper, z'' + 2 a z' + w^2 z = F/m, where",
        "a = R_out/(2 m) and w^2 = K_hand/m, has a closed form: C and S are the position after a tick T from unit displacement and from unit",
        "velocity, S' the derivative of S, and g the integral of S over the tick. The transfer functions of arm and controller are",
        "",
        "    z/F = (1/m) (g q + S^2 - g S') / (q^2 - (C + S') q + C S' + w^2 S^2)          q: shift by one tick",
        "    F/z = -[(K + B/(n T)) q^n - B/(n T)] / q^(n + d)                             B = (R_in - R_out) + K lead",
        "",
        "with K = K_coll, R_in - R_out what the head renders (the hand itself damps with R_out), the speed taken over n ticks, the device d ticks late (t_d = d T) and lead = T/2 + t_d, or 0 without the predictor. This is exact while the arm stays in the head. It comes to rest if",
        "the n + d + 2 roots of the loop's polynomial lie inside the unit circle, which the Schur-Cohn test decides without",
        "computing them (`shared/drumstick/safety/sampled_contact.py`). A set must pass four rules, for the lightest and the heaviest arm that the device declares (a simulated one: 0.85 to 1.2 times the scene's mass, in the scene's grip):",
        "",
        "- *The force does not come too late.* R_in > K_coll (T/2 + t_d), without credit for the prediction. R_in counts whole here, the hand's R_out in it.",
        "  A late spring pushes more on the way out than on the way in, and the damper must pay for it.",
        "- *A blow comes back slower.* A head pushes and never pulls, so the linear poles do not describe a whole blow. One is simulated at six phases of the",
        f"  tick, and must leave with less than {result['most_rebound']:g} of its speed (a head whose own restitution is higher: 1.01 times that, at most 0.98).",
        "- *Poles inside the unit circle*, in the firmest grip and in none. Here and in rebounds the hand's own damping gets no credit: a = 0. Without spring, delay and hand this is R_in < 2 m/T: with",
        "  more, the oscillation grows, at first with a period of four ticks.",
        "- *Limit cycles of encoder quantisation stay small.* The reading of an arm at rest still flips by a count. Through the damper, one count",
        f"  may change the speed by at most {1e3 * result['most_kick_m_per_s']:g} mm/s per tick, and with d ticks of delay by 1/(1 + {sampled_contact.VELOCITY_STEP_SHARE_PER_DELAY_TICK:g} d) of that, since a late",
        f"  force goes on after the count has flipped back. sqrt(K_coll/m) times a count may be at most {1e3 * result['most_swing_m_per_s']:g} mm/s. A blow of",
        f"  {1e3 * sampled_contact.SLOW_M_PER_S:g} mm/s, or up to a tenth more, which an encoder sees as a few counts, is played with a light, a middling and a heavy arm at several phases of the tick and of a count, and must leave",
        f"  with at most {result['most_slow_rebound']:g} of its speed: else a slow limit cycle could go on. These limits, and the {result['most_rebound']:g} above, were",
        "  found by trial on simulated arms; they are not derived.",
        "",
        f"The rebound of a blow of only a few counts depends on where within a count it falls, so the head takes some of it: while a blow that came at {1e3 * sampled_contact.SLOW_REBOUND_REDUCTION_M_PER_S:g} mm/s or less",
        f"leaves, the head pushes with {1.0 - sampled_contact.SLOW_REBOUND_REDUCTION:g} of its force, with all of it from {2e3 * sampled_contact.SLOW_REBOUND_REDUCTION_M_PER_S:g} mm/s on. An arm that sinks again, as one that is held down, gets the",
        "whole force back. And a head acts below z = 0 only, though a contact ends two counts above, so that one blow is one strike.",
        "",
        "The velocity window of a set may be at most the longest n that passes the second and third rule. A longer window adds lag, a shorter",
        "one quantisation noise: that is why quantisation also bounds the region at high stiffness.",
        "",
        "![Accepted stiffness and damping at eight settings, with simulated arms](images/servo-region.png)",
        "",
        f"An arm of {nominal:.0f} g in a loose hand ({result['k_hand_N_per_m']:g} N/m, {result['r_hand_N_s_per_m']:g} N s/m), unilateral release; `drumstick lab region`.",
        f"Each mark is a simulation with the servo's own code, faster than real time: the hand presses the arm into the head for {result['played_s']:g} s, without",
        f"friction and without the guard's passivity control, with {light:.0f}, {nominal:.0f} and {heavy:.0f} g. A cross: one of the three moves faster than {slow:.0f} mm/s at the end,",
        f"enters the head faster than at the contact before (above {slow:.0f} mm/s), or ends in a fault. The envelope judges each set by itself, and what a few counts do is chance: towards the stiff end the region is ragged and has holes.",
        "",
        f'"Refused now" is the share of the sets accepted before 2026-11-23, when R_in had no upper limit, that is refused now, in the range K_coll {k_low:g} .. {k_high:g} N/m and R_in {r_low:g} .. {r_high:g} N s/m, evenly by',
        f"their logarithms. At random: {regions[0]['sought']['sets']} accepted sets, half of them within 20 % of the stiffest, each with three random masses.",
        "",
        "| setting | refused now | for unstable poles | for an encoder limit cycle | for too large a rebound | stiffest accepted, N/m | accepted sets on the grid that do not come to rest | the same, random sets | largest final speed of the random sets, mm/s | refused sets on the grid that do come to rest |",
        "|---|---|---|---|---|---|---|---|---|---|",
        *(_row(region) for region in regions),
        "",
        *_beyond_rest(regions),
        "",
        f"Above the accepted range, at each stiffness played, the smallest R_in at which a simulated arm does not come to rest is {min(ratios):.1f} to {max(ratios):.1f} times the largest",
        f"accepted one; it then moves at {min(speeds):.0f} to {max(speeds):.0f} mm/s. Poles alone would not be enough: encoder counts sustain a limit cycle long before they leave the unit circle.",
        "A light arm takes less damping, and a stiff head needs a heavier arm: the last of the nine pictures.",
        "",
        *_search(held),
        *_known(held),
        "The linear boundary of a sampled wall is that of Gil, Avello, Rubio and Florez, IEEE Trans. Control Systems Technology 12(4), 2004,",
        "583-588, and with delay of Hulin, Preusche and Hirzinger, IROS 2006; the window is added here. Passivity asks more: b > K T/2 + |B|, where",
        "b is the arm's own damping alone and the rendered B counts *against* it (Colgate and Schenkel, J. Robotic Systems 14(1), 1997). No arm",
        "without damping of its own fulfils that, and none is claimed here. The guard's passivity observer watches the energy while it plays, after Hannaford",
        "and Ryu, IEEE Trans. Robotics and Automation 18(1), 2002.",
        "",
    ]


def _edges(bands: list[tuple[str, float, float]]) -> dict[str, float]:
    # Of one stiffness: where the arm begins and ends to be self-driven, and where counts begin and end to jerk it.
    found: dict[str, float] = {}
    calm = [band for band in bands if band[0] in ("accepted", "coarse", "fine")]
    if not calm:
        return found
    for rule, since, _ in bands[bands.index(calm[-1]) + 1 :]:
        if rule == "self-driven":
            found["drives above"] = since
            break
    good = [band for band in bands if band[0] == "accepted"]
    if good and bands.index(calm[0]) > 0 and bands[bands.index(calm[0]) - 1][0] == "rebound":
        found["back below"] = calm[0][1]
    if good and good[0] is not calm[0]:
        found["counts below"] = good[0][1]
    if good and good[-1] is not calm[-1]:
        found["counts above"] = good[-1][2]
    return found


def _draw_setting(axes: Any, region: dict[str, Any], low: float, high: float) -> None:
    import numpy as np
    from matplotlib.colors import ListedColormap

    from rig.figures.style import BLUE, GREEN, INK, PURPLE, ROLL, VERMILION, scaled

    k = [column["k_coll"] for column in region["columns"]]
    r = np.geomspace(low, high, 500)
    area = np.full((r.size, len(k)), np.nan)
    for at, column in enumerate(region["columns"]):
        for rule, since, to in column["bands"]:
            inside = (r >= since) & (r <= to)
            area[inside, at] = {"accepted": 0.0, "late": np.nan, "other": np.nan}.get(rule, 1.0)
    colours = ListedColormap([ROLL, REFUSED])
    axes.pcolormesh(
        k, r, area, shading="nearest", cmap=colours, vmin=0.0, vmax=1.0, rasterized=True, zorder=0
    )
    edges = [_edges(column["bands"]) for column in region["columns"]]
    for kind, colour, line in (
        ("drives", VERMILION, "-"),
        ("counts", GREEN, COUNTS),
        ("back", PURPLE, BACK),
    ):
        for side in ("below", "above"):
            axes.plot(
                k, [edge.get(f"{kind} {side}", np.nan) for edge in edges], color=colour, ls=line, lw=1.5
            )
    axes.plot(k, [column["late"] for column in region["columns"]], color=INK, ls=LATE, lw=1.3)
    points = region["points"]
    for safe, mark, colour, size in ((True, "o", BLUE, 2.6), (False, "x", VERMILION, 3.0)):
        chosen = [at for at, is_safe in enumerate(points["safe"]) if is_safe == safe]
        axes.plot(
            [points["k_coll"][at] for at in chosen], [points["r_in"][at] for at in chosen], ls="", marker=mark,
            ms=size, mew=0.8, mfc="white", color=colour, zorder=3,
        )  # fmt: skip
    scaled(axes, "x", "log")
    axes.set_yscale("log")
    axes.set_xlim(k[0], k[-1])
    axes.set_ylim(low, high)
    axes.set_title(_setting(region))


def draw() -> None:
    """Accepted K_coll and R_in at eight settings, with what the simulation makes of them; the largest R_in over
    mass."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.ticker import StrMethodFormatter

    from rig.figures.style import BLUE, DPI, GREEN, INK, ORANGE, PURPLE, ROLL, VERMILION, scaled

    result = read("region")
    low, high = result["r_hand_N_s_per_m"], result["r_N_s_per_m"][1]
    figure = Figure(figsize=(9.6, 10.4), dpi=DPI, layout="constrained")
    grid = figure.subplots(3, 3)
    panes = list(grid.flat)
    for at, (axes, region) in enumerate(zip(panes, result["regions"], strict=False)):
        _draw_setting(axes, region, low, high)
        axes.set_xticks([50, 200, 1000, 3500])
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.set_xlabel("K_coll, N/m")
        if at % 3 == 0:
            axes.set_ylabel("R_in, N s/m")
    last = panes[-1]
    for row, colour, line in zip(
        result["over_mass"], (BLUE, BLUE, ORANGE, ORANGE), ("-", (0, (4, 2))) * 2, strict=True
    ):
        masses = [1e3 * m for m in row["m_kg"]]
        most = [math.nan if r is None else r for r in row["largest"]]
        delay = "no delay" if row["delay"] == 0 else "1 tick"
        last.plot(masses, most, color=colour, ls=line, lw=1.5, label=f"{row['k_coll']:g} N/m, {delay}")
    scaled(last, "x", "log")
    scaled(last, "y", "log")
    last.set_title("largest accepted R_in, 1 kHz")
    last.set_xlabel("mass of the arm, g")
    last.legend(loc="lower right", borderaxespad=0.2, fontsize=8)
    figure.legend(
        handles=[
            Patch(color=ROLL, label="accepted"),
            Patch(color=REFUSED, label="accepted before, refused now"),
            Patch(facecolor="white", edgecolor=INK, lw=0.6, label="refused before and now"),
            Line2D([], [], color=INK, ls=LATE, lw=1.3, label="below: the force comes too late"),
            Line2D([], [], color=PURPLE, ls=BACK, lw=1.5, label="below: a blow comes back too fast"),
            Line2D([], [], color=GREEN, ls=COUNTS, lw=1.5, label="outside: encoder limit cycle"),
            Line2D([], [], color=VERMILION, lw=1.5, label="above: poles outside the unit circle"),
            Line2D(
                [], [], color=BLUE, marker="o", mfc="white", ms=4, ls="", label="simulated: comes to rest"
            ),
            Line2D(
                [], [], color=VERMILION, marker="x", ms=4.5, ls="", label="simulated: does not come to rest"
            ),
        ],
        loc="outside lower center",
        ncols=3,
    )
    figure.savefig(PICTURE, metadata={"Software": None})
