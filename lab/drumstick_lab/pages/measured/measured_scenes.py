"""The part of docs/measured.md that tells what each scene compiles, holds, sends and shows, from the stored result."""

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
