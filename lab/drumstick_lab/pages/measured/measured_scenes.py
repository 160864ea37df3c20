"""Parts of docs/measured.md: what each scene compiles, holds, sends and shows; what `import drumstick` takes."""

from typing import Any

from drumstick_lab.pages.measured.stored import read, where

_TAKES_APART = ["drumstick.drum.block.render_all"]


def _is_the_same(row: dict[str, Any]) -> bool:
    if not (row["same_strikes"] and row["same_sound"] and row["same_memory"]):
        return False
    return not row["only_in_whole"] and not row["only_in_bare"] and row["other_code"] in ([], _TAKES_APART)


def _sent(row: dict[str, Any]) -> str:
    if "sent_per_s" not in row:
        return "offline only | | "
    osc, zenoh = (
        sum(count for key, count in row["sent_per_s"].items() if key.startswith(wire))
        for wire in ("osc", "zenoh")
    )
    return f"{osc:.0f}, {zenoh:.0f} | {len(row['listed'])} | {row['sliders']}"


def only_what_is_called_for() -> list[str]:
    """Lines of the section."""
    result = read("as_called_for")
    lines = [
        "",
        "## Only what a scene calls for",
        "",
        "`drumstick lab as-called-for`: each scene is played by the whole library, and by one from which every effect is taken that the scene does not name.",
        "Strikes and sound must be the same bytes, and the machine code of every kernel the same but for symbols' names. (Excepted is `render_all`, which Python",
        "calls: it takes the drum's memory apart, in which absent effects have names and no length.) Then a rig plays the scene: the messages that it",
        f"sends a second to an OSC client and to a Zenoh client that subscribes to everything, the live values that it lists, the sliders of its page when it opens. {where(result)}",
        "",
        "| scene | effects of the stick | effects of the drum | kernels | stick, bytes | drum, kB | same without the others | OSC, Zenoh a second | live values | sliders |",
        "|---|---|---|---|---|---|---|---|---|---|",
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
        "### A script in Python",
        "",
        f"`drumstick lab python-face`: whole processes, the median of {result['runs']}. {where(result)}",
        "",
        "| what | processor time, s | memory, MB | more than bare Python, MB |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {_PROGRAMS[name]} | {row['s']:.2f} | {row['MB']:.0f} | {row['MB'] - bare['MB']:.1f} |"
        for name, row in result["rows"].items()
    ]
    return lines
