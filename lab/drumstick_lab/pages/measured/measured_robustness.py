"""The lines of docs/measured.md about what lasts: a month, a soak, torture, the suite and the gateway's wait, from the
stored results.
"""

from typing import Any

from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import exists, read


def month() -> list[str]:
    """Lines about a month of ticks."""
    found = read("month")
    hours = found["processor_s"] / 3600.0
    low, high = found["roll_rate_Hz"]
    return [
        "",
        *heading("## A month of ticks", "month"),
        f"`drumstick lab month`: {found['ticks']:.3g} ticks in virtual time, from {found['start_ns']:.3g} ns on, {hours:.1f} hours of a "
        "processor.",
        "",
        f"{found['strikes']} strikes, {found['dropped']} dropped; every strike within {found['furthest_from_exact_ns']:.1f} ns of where the exact cycle has",
        f"it; the day's rate between {low:.7f} and {high:.7f} Hz; memory grew by {max(found['resident_growth_kB'])} kB.",
    ]


def soak() -> list[str]:
    """Lines about a soak."""
    found = read("soak")
    lines = [
        "",
        *heading("## A soak", "soak"),
        f"`drumstick soak --real-time --duration {found['duration_s']:.0f} --out DIR` ([what it does](soak.md)): {found['strikes']:,} strikes,"
        f" {found['strikes_per_s']:.0f} a second,",
        f"{found['speed']:g} times those of `{found['scene']}`, with a visit every second or so: {'passed' if found['passed'] else 'not passed'}.",
        "",
        "| process | resident memory, MB | kB an hour, with 95 % confidence | descriptors an hour | threads an hour | verdict on the memory |",
        "|---|---|---|---|---|---|",
    ]
    rows = {row["name"]: row for row in found["quantities"]}
    for name, row in rows.items():
        who, _, what = name.rpartition(" ")
        if what == "rss_kB":
            slope = row["slope"]
            others = " | ".join(
                f"{rows[f'{who} {other}']['slope']['per_h']:.3g}" for other in ("descriptors", "threads")
            )
            lines.append(
                f"| {who} | {row['last'] / 1e3:.0f} | {slope['per_h']:+.0f} ({slope['low']:+.0f} .. {slope['high']:+.0f}) | {others} | {row['words']} |"
            )
    counted = [row for row in rows.values() if row["slope"] is None]
    lines += ["", "| counted | | |", "|---|---|---|"]
    return lines + [
        f"| {row['name']} | {row['last']:.0f} | {row['words']}{'' if row['passed'] is not None else '; reported, not judged'} |"
        for row in counted
    ]


def torture() -> list[str]:
    """Lines about a rig that is tortured."""
    found = read("torture")
    panics, values, strikes = found["panics"], found["values"], found["strikes"]
    lines = [
        "",
        *heading("## A rig that is tortured", "torture"),
        "`drumstick lab torture`: services killed and stopped, floods, a full disk, output that nobody reads, busy processors, a clock that",
        f"jumps, a link that is cut, one or two at a time on a playing rig: {found['minutes']:.0f} minutes, {found['rounds']} rounds.",
        "",
        f"Promises broken: {len(found['broken'])}. Strikes heard by a listener: {strikes['heard']:,}, lost: {strikes['lost']}. Values accepted:"
        f" {values['accepted']:,}, lost: {values['lost']}.",
        f"Panics sent once: {panics['sent']}, the longest took {panics['longest_s'] * 1e3:.0f} ms until the state said so; sent again and"
        f" again after the gateway was killed: {panics['after_a_kill']}, the longest {panics['longest_after_a_kill_s']:.1f} s.",
        "",
        "| what was done | rounds | strikes lost | s until strikes are back | until sound | until panel |",
        "|---|---|---|---|---|---|",
    ]
    for name, row in sorted(found["harms"].items()):
        cells = [
            f"{total / count:.2f} (at most {most:.2f})" if count else ""
            for count, total, most in (
                row["back_s"].get(part, (0, 0.0, 0.0)) for part in ("strikes", "sound", "panel")
            )
        ]
        lines.append(f"| {name} | {row['rounds']} | {row['strikes_lost']} | {' | '.join(cells)} |")
    if found["not_tried"]:
        lines += ["", f"Not tried here: {'; '.join(found['not_tried'])}."]
    return lines


def _spent_s(run: dict[str, Any], part: str) -> float:
    # Of `make test`; what is no part of it has a row of its own.
    if part != "whole":
        return run["seconds"].get(part, 0.0)
    return sum(spent for name, spent in run["seconds"].items() if not name.startswith("long"))


def suite() -> list[str]:
    """Lines about the runs of the suite."""
    if not exists("suite"):  # a run takes many minutes: the first one makes the section
        return []
    runs = read("suite")["runs"]
    red = [run for run in runs if not run["passed"]]
    kinds = {
        f"{machine}{store}": [
            run for run in runs if (run["beside_a_busy_core"], run["cold"]) == (is_busy, is_cold)
        ]
        for is_cold, store in ((False, ""), (True, ", no kernel compiled"))
        for is_busy, machine in ((False, "quiet"), (True, "beside a busy core"))
    }
    lines = [
        "",
        *heading("## The suite", "suite"),
        f"`drumstick lab suite`: runs of `make test`: {len(runs)}; beside a process that kept one core busy: {sum(run['beside_a_busy_core'] for run in runs)};"
        f" red: {len(red)}; tests that failed while the machine stood still and were run once more: {sum(run['reruns'] for run in runs)}."
        " Seconds, least to most; eight minutes are meant for a quiet machine whose kernels are compiled. The log begins on 2026-11-28. Twenty runs two days before,"
        " of versions that changed between them, took 5 to 10 minutes, and eight were red (`git show cb3bb12b^:lab/results/suite.json`).",
        "",
        f"| part | tests | {' | '.join(kinds)} |",
        "|---|---|---|---|---|---|",
    ]
    for part in ("whole", *dict.fromkeys(name for run in runs for name in run["seconds"])):
        count = next((run["tests"][part] for run in reversed(runs) if part in run["tests"]), "")
        spent = [
            [_spent_s(run, part) for run in of_kind if _spent_s(run, part)] for of_kind in kinds.values()
        ]
        cells = [f"{min(each):.0f} - {max(each):.0f}" if each else "" for each in spent]
        lines.append(f"| {part} | {count} | {' | '.join(cells)} |")
    # Causes are written into the row by whoever found them.
    failed: dict[str, list[str]] = {}
    for run in red:
        for name in run["failed"]:
            failed.setdefault(name, []).append(run.get("causes", {}).get(name, "not yet explained"))
    if failed:
        lines += ["", "Tests that were red in at least one of them, and whose fault it was:", ""]
        lines += [
            f"- `{name}`: {'; another time '.join(dict.fromkeys(causes))}."
            for name, causes in sorted(failed.items())
        ]
    return lines


_MOTIONS = {
    "lying": "lies in the head",
    "swung": "is swung above it",
    "rolling": "rolls at 23 Hz",
    "unforeseen": "is held still, and strikes unforeseen",
}


def gateway_wait() -> list[str]:
    """Lines about the cost of waiting for a strike, and what is waited for."""
    found = read("gateway_share")
    lines = [
        "",
        *heading("## What waiting for a strike costs", "gateway_share"),
        "`drumstick lab gateway-share`: the gateway as it is beside one that looks every 150 us whatever the stick does, in turns. Share of a",
        f"core and wake-ups a second: medians of {found['turns']} turns. From the tick to an OSC port, above what a bare datagram of the servo's takes: of all strikes.",
        "",
        "| the stick | share of a core | every 150 us | wake-ups a second | every 150 us | OSC above bare p50, p99 us | every 150 us |",
        "|---|---|---|---|---|---|---|",
    ]
    for motion, words in _MOTIONS.items():
        rows = [found["rows"][way][motion] for way in ("foreseen", "steady")]
        above = [
            f"{row['osc_above_bare_p50_us']:.0f}, {row['osc_above_bare_p99_us']:.0f}"
            if "strikes" in row
            else ""
            for row in rows
        ]
        lines.append(
            f"| {words} | {rows[0]['share']:.1%} | {rows[1]['share']:.1%} | {rows[0]['wakes_per_s']:.0f} | {rows[1]['wakes_per_s']:.0f} |"
            f" {above[0]} | {above[1]} |"
        )
    lines += [
        "",
        f"Aimed at: at rest {found['share_goal']:.0%} of the steady gateway's share (here {found['share_of_steady']:.0%}), in a roll at most"
        f" {found['above_bare_goal_us']:.0f} us above a bare datagram.",
        "A strike that nothing foresaw waits for the end of the longest sleep, 2 ms: a stick that is struck from a hold by more than 1000 m/s²",
        "([why](decisions/0062-waiting-for-a-contact.md)).",
    ]
    return lines
