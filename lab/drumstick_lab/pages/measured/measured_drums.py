"""The part of docs/measured.md that sets the scenes' drums beside recorded ones, from the stored result."""

from typing import Any

from drumstick_lab.pages.measured.stored import read, where


def _row(name: str, drum: dict[str, Any], beside: str, away: str) -> str:
    soft, hard = (" ".join(f"{level:.0f}" for level in drum[key]) for key in ("softest_dB", "hardest_dB"))
    decays = " ".join("-" if value is None else f"{value:.2f}" for value in drum["t60_s"])
    return f"| {name} | {soft} | {hard} | {drum['rise_dB']:.1f} | {drum['flatness']:.3f} | {decays} | {beside} | {away} |"


def recordings() -> list[str]:
    """Lines of the section."""
    found = read("beside_recordings")
    lines = [
        "",
        "## Drums beside recorded ones",
        "",
        "`drumstick lab beside-recordings`: five strokes of each drum, softest to hardest, beside the drum kits that Debian packages for",
        "Hydrogen. Levels of the bands 0.5-1, 1-2, 2-4, 4-8 and 8-16 kHz to the whole stroke, dB; by how much 1-8 kHz rise from the softest",
        "stroke to the brightest; flatness from 0.5 to 8 kHz; T60 of the octaves from 125 Hz to 8 kHz; and how far the levels lie from the",
        f"recording that a scene was made beside, and from the median of kits that nothing was made beside. {where(found)}",
        "",
        "| drum | softest | hardest | rise dB | flatness | T60 s | from its recording dB | from other kits dB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, drum in found["scenes"].items():
        made, away = drum["made_beside"], drum["distance_dB"]["work"]
        beside = f"{away[made]:.1f} ({made})" if made else "-"
        held = drum.get("median_held_out_dB")
        lines.append(_row(f"`{name}`", drum, beside, "-" if held is None else f"{held:.1f}"))
    for kind in found["recordings"].values():
        lines += [_row(name, drum, "", "") for name, drum in kind["work"].items()]
    apart = [
        f"{pair} {value:.1f}"
        for kind in found["among_recordings_dB"].values()
        for pair, value in kind.items()
    ]
    return [*lines, "", f"The recordings among themselves, dB: {'; '.join(apart)}."]
