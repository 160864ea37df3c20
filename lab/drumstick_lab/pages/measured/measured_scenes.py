"""Parts of docs/measured.md: what each scene compiles and sends, its roll as asked for, what the first start and
`import drumstick` take.
"""

from typing import Any

from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read

# They take the memory of a drum apart field by field: there they may know of more names than the scene has.
CALLED_FROM_PYTHON = {"drumstick.drum.block.render_all", "drumstick.drum.block.render_unlimited"}


def _is_the_same(row: dict[str, Any]) -> bool:
    if not (row["same_strikes"] and row["same_sound"] and row["same_memory"]):
        return False
    if row["only_in_whole"] or row["only_in_bare"]:
        return False
    return set(row["other_code"]) <= CALLED_FROM_PYTHON


# Of the roll as a whole, where a scene has one: made of other values.
_OF_THE_ROLL = {"rate", "level"}


def _in_the_rig(row: dict[str, Any]) -> str:
    if "sent_per_s" not in row:
        return "offline only |  |  |  | "
    osc, zenoh = (
        sum(count for key, count in row["sent_per_s"].items() if key.startswith(wire))
        for wire in ("osc", "zenoh")
    )
    drawn = row.get("drawn")  # results of before 2026-11-28 do not have it
    cells = "| | " if drawn is None else f"{drawn['controls']} | {drawn['plots']} | {drawn['nodes']}"
    return f"{osc:.0f}, {zenoh:.0f} | {len(row['listed'])} | {cells}"


def drawn_beside_listed(rows: dict[str, Any]) -> str:
    """Sentence on whether each page has a control for just the values that its rig lists."""
    drawn = {name: row for name, row in rows.items() if "drawn" in row}
    other = [
        f"`{name}` ({', '.join(sorted(differs))})"
        for name, row in drawn.items()
        if (differs := (set(row["drawn"]["values"]) - _OF_THE_ROLL) ^ set(row["listed"]))
    ]
    if not drawn:
        return "What the pages draw was not measured."
    found = f"BUT FOR {', '.join(other)}" if other else "in every scene"
    return (
        f"A page has a control for each of its scene's live values and for no other: {found}. Where the scene has a roll, it has"
        " two more, of rate and level."
    )


def only_what_is_called_for() -> list[str]:
    """Lines of the section."""
    result = read("as_called_for")
    lines = [
        "",
        *heading("## Only what a scene calls for", "as_called_for"),
        "`drumstick lab as-called-for`: each scene is played by the whole library, and by one from which every effect is taken that the scene does not name.",
        "Strikes and sound must be the same bytes, and the machine code of every kernel the same but for symbols' names. (Excepted are `render_all` and",
        "`render_unlimited`, which Python calls: they take the drum's memory apart, in which absent effects have names and no length.) Then a rig plays the scene: the messages that it",
        "sends a second to an OSC client and to a Zenoh client that subscribes to everything, the live values that it lists, and what is drawn on the page: the controls,",
        "the plots of the view that a visitor finds open, and the parts of the picture in 3-D, which has drum, stick and marks of strikes in every scene.",
        drawn_beside_listed(result["rows"]),
        "",
        "| scene | effects of the stick | effects of the drum | kernels | stick, bytes | drum, kB | same without the others | OSC, Zenoh a second | live values | controls | plots | in 3-D |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in result["rows"].items():
        effects = " | ".join(
            ", ".join(f"`{each}`" for each in row["effects"][part]) or "-" for part in ("stick", "drum")
        )
        lines.append(
            f"| `{name}` | {effects} | {row['kernels']} | {row['stick_bytes']} | {row['drum_bytes'] / 1e3:.0f} |"
            f" {'yes' if _is_the_same(row) else 'NO'} | {_in_the_rig(row)} |"
        )
    return lines


def _worst(rows: list[dict[str, Any]], name: str) -> float:
    return max((row[name] for row in rows if row[name] is not None), default=0.0)


def rate_and_level() -> list[str]:
    """Lines of the section about rates and levels that were asked for."""
    found = read("rate_and_level")
    rows: dict[str, dict[str, Any]] = found["rows"]
    every = list(rows.values())
    met, refused, failed = (
        sum(row["met"] for row in every),
        sum(row["refused_with_a_nearest_that_plays"] for row in every),
        sum(len(row["failed"]) for row in every),
    )
    return [
        "",
        *heading("## Rate and level, as asked for", "rate_and_level"),
        f"`drumstick lab rate-and-level`: {found['targets']} targets at random, over every shipped scene that has a steady roll, each from what the one before left.",
        "Judge is the exact simulation: the last 32 of 300 contacts of a thrown stick must have the rate within"
        f" {found['rate_tolerance']:.0%} and the level within {found['level_tolerance_dB']:g} dB.",
        f"Met: {met}. Refused with a nearest roll, which itself plays as it is named: {refused}. Neither: {failed}.",
        "",
        "| scene | targets | met | refused with a nearest | neither | rate off at most | level off at most, dB |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| `{name}` | {row['targets']} | {row['met']} | {row['refused_with_a_nearest_that_plays']} | {len(row['failed'])} |"
            f" {max(_worst([row], 'worst_rate_off'), _worst([row], 'worst_rate_off_of_nearest')):.1e} |"
            f" {max(_worst([row], 'worst_level_off_dB'), _worst([row], 'worst_level_off_dB_of_nearest')):.1e} |"
            for name, row in rows.items()
        ),
    ]


_PROGRAMS = {
    "python": "bare Python (baseline)",
    "import": "`import drumstick`",
    "numba": "`import numba`, which comes when something is computed",
    "scene": "`import drumstick`, and read a scene",
    "simulate": "... and simulate 10 s of its roll, kernels compiled before",
}


def first_start() -> list[str]:
    """Lines about the start that compiles the kernels, and the next one."""
    found = read("first_start")
    runs = "one run" if found["runs"] == 1 else f"the median of {found['runs']} runs"
    lines = [
        "",
        *heading("### The first start", "first_start"),
        f"`drumstick lab first-start`: `drumstick up` with an empty store of compiled kernels, and again; {runs}."
        f" Importing numba and zenoh took {found['imports_s']:.2f} s at that time.",
        "",
        "| kernels | until an OSC client hears a strike, s | processor time, s | until the sound server has played one, s | processor time, s |",
        "|---|---|---|---|---|",
    ]
    names = {"empty": "none yet: compiled at the start", "filled": "there from the first start"}
    for store, row in found["rows"].items():
        cells = " | ".join(
            f"{row[name]:.1f}" for name in ("strike_s", "strike_processor_s", "sound_s", "sound_processor_s")
        )
        lines.append(f"| {names[store]} | {cells} |")
    if "beside" in found:
        earlier = [row["strike_processor_s"] for row in found["beside"]["rows"].values()]
        shares = [
            row["strike_processor_s"] / other
            for row, other in zip(found["rows"].values(), earlier, strict=True)
        ]
        lines += [
            "",
            f"Version {found['beside']['version']}, started in turns with this one (`--beside CHECKOUT`), took {earlier[0]:.1f} s of processor time until"
            f" the strike without kernels and {earlier[1]:.1f} s with them; this version takes {shares[0]:.2f} and {shares[1]:.2f} of that.",
        ]
    return lines


def python_face() -> list[str]:
    """Lines of the section on what a script in Python waits for and holds."""
    result = read("python_face")
    bare = result["rows"]["python"]
    lines = [
        "",
        *heading("### A script in Python", "python_face"),
        f"`drumstick lab python-face`: whole processes, the median of {result['runs']}.",
        "",
        "| what | processor time, s | memory, MB | more than bare Python, MB |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {_PROGRAMS[name]} | {row['s']:.2f} | {row['MB']:.0f} | {row['MB'] - bare['MB']:.1f} |"
        for name, row in result["rows"].items()
    ]
    return lines


def scene_change() -> list[str]:
    """Lines of the section about what a change of scene does to strikes and sound, and a PANIC amid it."""
    found, panic = read("scene_change"), read("panic_amid_change")
    lowest = found["lowest_dB"]
    return [
        "",
        *heading("## A change of scene", "scene_change", "panic_amid_change"),
        f"`drumstick lab scene-change`: {found['changes']} changes by OSC between two scenes that roll; the goal is {found['goal_s']:g} s without a strike.",
        "",
        "| gap | p50, s | worst, s | within the goal |",
        "|---|---|---|---|",
        *(
            f"| {name} | {row['p50_s']:.3f} | {row['worst_s']:.3f} | {row['within_goal']} of {found['changes']} |"
            for name, row in found["rows"].items()
        ),
        "",
        f"At the weakest places of the sound it is {-lowest['p50']:.0f} dB below its usual level at the median, {-lowest['worst']:.0f} dB at most; silence, 60 dB below the"
        f" peak, lasts {1e3 * found['longest_silence_s']:.1f} ms at most.",
        "",
        f"`drumstick lab panic-amid-change`: `/drumstick/panic` at random instants of {panic['changes']} such changes, in {panic['about_handover']} about the handover from one servo to the"
        f" next. In {panic['held_in']} none struck again before `drumstick arm`; in {panic['within_goal']} the force was off within {panic['goal_ms']:.0f} ms of the moment before the"
        f" datagram was sent. The last sign of a force came {panic['last_force_worst_ms']:.0f} ms after it at the latest. Where the servo that played had ended,"
        " the next is held from its start, and the state that says so comes when its gateway is up.",
        "",
        "| told by | changes | until a state tells panic, p50 ms | worst, ms |",
        "|---|---|---|---|",
        *(
            f"| {name} | {row['count']} | {row['p50']:.0f} | {row['worst']:.0f} |"
            for name, row in panic["rows_ms"].items()
        ),
    ]
