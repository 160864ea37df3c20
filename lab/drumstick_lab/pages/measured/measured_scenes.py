"""Parts of docs/measured.md: what each scene compiles and sends, its roll as asked for, what `import drumstick` takes."""

from typing import Any

from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read

_TAKES_APART = ["drumstick.drum.block.render_all"]


def _is_the_same(row: dict[str, Any]) -> bool:
    if not (row["same_strikes"] and row["same_sound"] and row["same_memory"]):
        return False
    return not row["only_in_whole"] and not row["only_in_bare"] and row["other_code"] in ([], _TAKES_APART)


def _sent(row: dict[str, Any]) -> str:
    if "sent_per_s" not in row:
        return "offline only | "
    osc, zenoh = (
        sum(count for key, count in row["sent_per_s"].items() if key.startswith(wire))
        for wire in ("osc", "zenoh")
    )
    return f"{osc:.0f}, {zenoh:.0f} | {len(row['listed'])}"


def only_what_is_called_for() -> list[str]:
    """Lines of the section."""
    result = read("as_called_for")
    lines = [
        "",
        *heading("## Only what a scene calls for", "as_called_for"),
        "`drumstick lab as-called-for`: each scene is played by the whole library, and by one from which every effect is taken that the scene does not name.",
        "Strikes and sound must be the same bytes, and the machine code of every kernel the same but for symbols' names. (Excepted is `render_all`, which Python",
        "calls: it takes the drum's memory apart, in which absent effects have names and no length.) Then a rig plays the scene: the messages that it",
        "sends a second to an OSC client and to a Zenoh client that subscribes to everything, and the live values that it lists.",
        "",
        "| scene | effects of the stick | effects of the drum | kernels | stick, bytes | drum, kB | same without the others | OSC, Zenoh a second | live values |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, row in result["rows"].items():
        effects = " | ".join(
            ", ".join(f"`{each}`" for each in row["effects"][part]) or "-" for part in ("stick", "drum")
        )
        lines.append(
            f"| `{name}` | {effects} | {row['kernels']} | {row['stick_bytes']} | {row['drum_bytes'] / 1e3:.0f} |"
            f" {'yes' if _is_the_same(row) else 'NO'} | {_sent(row)} |"
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
    "numba": "`import numba`, which `import drumstick` leaves until a scene is read",
    "scene": "`import drumstick`, and read a scene",
    "simulate": "... and simulate 10 s of its roll, kernels compiled before",
}


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
