"""The lines of docs/measured.md about the panel, from the stored results."""

from typing import Any

from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import exists, read


def looking() -> list[str]:
    """Cost of looking at the drum."""
    found = read("panel_cost")
    audio, rows = found["audio_ns"], found["share_of_core"]
    block_us = found["block_frames"] / 48.0 * 1e3
    lines = [
        "",
        *heading("## What looking costs", "panel_cost"),
        "`drumstick lab panel-cost`: CPU time of the panel and of the sound server while a roll plays, each with its",
        f"children, over {found['window_s']:g} s; one browser looks, whose own time is not counted.",
        "",
        "| looked at | panel, of a core | sound server, of a core |",
        "|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['web_panel']:.1%} | {row['sound_server']:.1%} |" for name, row in rows.items()
    ]
    lines += [
        "",
        'The views were on a narrow page, which has no picture; "the picture" is a wide page without a view. What the audio thread has to do for it:',
        "",
        "| what | ns | of a block |",
        "|---|---|---|",
    ]
    lines += [f"| {name} | {ns:.0f} | {ns / 1e3 / block_us:.4%} |" for name, ns in audio.items()]
    return lines


def on_stage() -> list[str]:
    """Cost of the stage page; no lines until it was measured in a quiet moment."""
    if not exists("panel_stage"):
        return []
    found = read("panel_stage")
    return [
        "",
        *heading("## What the stage page costs", "panel_stage"),
        f"`drumstick lab panel-stage`: CPU time of the panel while a roll plays, the median of {found['rounds']} windows of"
        f" {found['window_s']:g} s, by turns; the goal is {found['goal']:.0%} with one page. One page costs {found['ratio']:g}"
        " times what nobody costs.",
        "",
        "| open | panel, of a core | frames a second, of the first page |",
        "|---|---|---|",
        *(
            f"| {name} | {row['share']:.1%} | {row.get('frames_per_s', 0.0):.1f} |"
            for name, row in found["rows"].items()
        ),
    ]


def panel() -> list[str]:
    """Delay from a move on the page to the force, and the page's cost."""
    found = read("panel_latency")
    names = {
        "force": "the first contact with another force begins",
        "used": "the servo uses it (its readback on the wire)",
        "shown": "the page shows the readback",
        "foreseen": "the page shows what it would do",
    }
    lines = [
        "",
        *heading("## From the page to the force", "panel_latency"),
        f"`drumstick lab panel-latency`: {found['moves']} steps of the slider of K_coll, by key, on the real rig in a real browser, all on the",
        f"same two cores (and the desktop's picture of the drum drawn without a graphics card); the goal is {found['goal_ms']:.0f} ms at the median. The stick has to rise above the head and come down again in it.",
        "",
        "| page | from the key until | p50 ms | p90 ms | longest ms |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {size} | {names[name]} | {row['p50']:.0f} | {row['p90']:.0f} | {row['max']:.0f} |"
        for size, rows in found["rows_ms"].items()
        for name, row in rows.items()
    ]
    lines += ["", "| share of a core | panel | what computes for it |", "|---|---|---|"]
    for name, shares in found["share_of_core"].items():
        cells = " | ".join(
            f"{shares[which]:.1%}" if which in shares else "–" for which in ("panel", "computing")
        )
        lines.append(f"| {name} | {cells} |")
    one, new = found["one_prediction_ms"], found["newcomer_s"]
    memory, first = found["resident_MB"], found["foreseen_first"]
    return [
        *lines,
        "",
        f"A value is sent at once; its prediction is drawn when it is computed. Of {found['moves']} moves, the page had drawn the prediction before or",
        f"with the readback in {_by_page(first, 'shown')}, and before the force had changed in {_by_page(first, 'force')}.",
        "A newcomer has 30 s from the printed address to a faster roll. The machine takes"
        f" {new['roll_on_the_page']:.1f} s of them until the page shows the roll, and {new['faster_roll_on_the_page']:.1f} s for twelve steps"
        " of the first slider until it shows a faster one; the rest is for reading.",
        f"One prediction takes {one['p50']:.1f} ms of its time at the median, {one['max']:.1f} ms at most, over {one['values']} values of dv_pls.",
        f"The panel takes {memory['panel']:.0f} MB of memory, what computes for it {memory['computing']:.0f} MB.",
    ]


def _by_page(counts: dict[str, dict[str, int]], than: str) -> str:
    return " and ".join(f"{row[than]} ({size})" for size, row in counts.items())


def attacked() -> list[str]:
    """Effect of attacks on the page on the force."""
    found = read("panel_attack")
    names = {
        "none": "nobody",
        "no token": "connections without the token, as many as come",
        "megabytes": "frames of a megabyte, with the token",
        "messages": f"{found['messages_per_s']} messages a second, with the token, all out of range",
        "pads": "places of a pad, with the token, as many as go",
    }
    lines = [
        "",
        *heading("## What an attack on the page does to the force", "panel_attack"),
        f"`drumstick lab panel-attack`: windows of {found['window_s']:g} s in turn, on the real rig; the attacker is a process on the same two",
        "cores. Lateness of the servo's ticks by its own histogram (10 µs a bin), and how long an honest visitor's change takes until the servo uses"
        " it.",
        "",
        "| attacked by | ticks late, p50 µs | p99 µs | p99.9 µs | an honest change, p50 ms | longest ms |",
        "|---|---|---|---|---|---|",
    ]
    for row in found["rows"]:
        late, took = row["lateness_us"], row["set_ms"]
        cells = " | ".join(
            "over 5110" if late[name] is None else f"{late[name]:.0f}" for name in ("p50", "p99", "p99.9")
        )
        lines.append(f"| {names[row['attack']]} | {cells} | {took['p50']:.0f} | {took['max']:.0f} |")
    return lines + (_attacked_from_the_network(found["network"]) if "network" in found else [])


def _attacked_from_the_network(found: dict[str, Any]) -> list[str]:
    def ms(took: dict[str, float]) -> str:
        return f"{took['p50']:.0f} | {took['max']:.0f}"

    lines = [
        "",
        f"The page that is opened to the network (`--panel-lan`), over TLS, in windows of {found['window_s']:g} s; the attacker has one address, where nothing else is said.",
        "Another visitor, who has logged in, presses PANIC by turns on a page that he has open and on one that he dials anew, again and again where there is no place for him:",
        "from his press, or the begin of his dialling, until the servo says that it has heard. Then what the panel's process has: before, at its most, and when its descriptors were back.",
        "",
        "| attacked by | PANIC on an open page, p50 ms | longest ms | on one dialled anew, p50 ms | longest ms | of so many presses | turned away | ticks missed | ticks late, p99.9 µs | a question to the gateway, longest ms | memory, MB | threads at most | descriptors | back after s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in found["rows"]:
        before, most, after = row["before"], row["most"], row["after"]
        late_us = row["lateness_us"]["p99.9"]
        late = "over 5110" if late_us is None else f"{late_us:.0f}"
        memory = ", ".join(f"{each['MB']:.0f}" for each in (before, most, after))
        descriptors = ", ".join(f"{each['descriptors']}" for each in (before, most, after))
        lines.append(
            f"| {'nobody' if row['attack'] == 'none' else row['attack']} | {ms(row['open_ms'])} | {ms(row['dialled_ms'])} | {row['pressed']} | {row['refused']}"
            f" | {row['overruns']} | {late} | {row['gateway_ms']:.0f} | {memory} | {most['threads']} | {descriptors} | {row['back_s']:.1f} |"
        )
    return lines


def panic_place() -> list[str]:
    """Places of PANIC through all states; no lines until they were measured."""
    if not exists("panic_place"):
        return []
    found = read("panic_place")
    lines = [
        "",
        *heading("## Where PANIC is", "panic_place"),
        f"`drumstick lab panic-place`: {found['states']} of {found['of_states']} states of rig and page at {len(found['boxes'])} sizes, each made by a real event, every frame watched.",
        "",
        "| window | places of PANIC: left, top, width, height in pixels | in so many states |",
        "|---|---|---|",
    ]
    for size, rows in found["boxes"].items():
        places = "; ".join(row["box"] for row in rows)
        counts = "; ".join(
            f"{row['states']}" + (f" ({', '.join(row['named'])})" if row["named"] and len(rows) > 1 else "")
            for row in rows
        )
        zoom = found.get("zoom", {}).get(size)
        lines.append(f"| {size}{f', at a zoom of {zoom:.0%}' if zoom else ''} | {places} | {counts} |")
    covered = "; ".join(f"{state} ({', '.join(sizes)})" for state, sizes in found["covered_in"].items())
    return [
        *lines,
        "",
        f"Something lay over its middle in: {covered or 'no state'}. The key Esc is PANIC in all of them while the page has its connection.",
        *_deaf(found),
    ]


def _deaf(found: dict[str, Any]) -> list[str]:
    if "deaf_in" not in found:  # stored before it was told from what is covered
        return [
            "A page whose panel has ended takes no clicks until another one has taken its place: that was counted as covered, too."
        ]
    deaf = "; ".join(f"{state} ({', '.join(sizes)})" for state, sizes in found["deaf_in"].items())
    return [
        f"It was there and took no clicks, since the page had lost its panel, in: {deaf or 'no state'}; the page says so, after"
        f" {found['deaf_unsaid_ms']:.0f} ms at most."
    ]


def stopwatch() -> list[str]:
    """Times from the command to a strike, and further; no lines until they were measured."""
    if not exists("stopwatch"):
        return []
    found = read("stopwatch")
    return [
        "",
        *heading("## By the stopwatch", "stopwatch"),
        "`drumstick lab stopwatch`: each way by a script in a browser that was never here, beside an OSC client that stands for the DAW. The kernels were",
        "compiled, but for the cold start. From the network a phone comes in by the login link that is printed.",
        "",
        "| page | from | s | clicks | keys |",
        "|---|---|---|---|---|",
        *(
            f"| {size} | {words} | {row['s']:.1f} | {row['clicks']} | {row['keys']} |"
            for size, rows in found["rows"].items()
            for words, row in rows.items()
        ),
    ]


def accessibility() -> list[str]:
    """Findings of axe on the page; no lines until it was asked."""
    if not exists("accessibility"):
        return []
    found = read("accessibility")
    return [
        "",
        *heading("## What axe finds on the page", "accessibility"),
        "`drumstick lab accessibility`: with all folders open, and the page for a second screen. Where only a pseudo-element kept axe from deciding a",
        "contrast of what lies beside it, the contrast is decided without it.",
        "",
        "| page | axe | violations | undecided | rules passed |",
        "|---|---|---|---|---|",
        *(
            f"| {size} | {row['axe']} | {_listed(row['violations'])} | {_listed(row['undecided'])} | {row['rules_passed']} |"
            for size, row in found["rows"].items()
        ),
    ]


def _listed(found: list[list[Any]]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in found) or "none"


def everything() -> list[str]:
    """All sections about the panel."""
    sections = (panel, attacked, looking, on_stage, panic_place, stopwatch, accessibility)
    return [line for section in sections for line in section()]
