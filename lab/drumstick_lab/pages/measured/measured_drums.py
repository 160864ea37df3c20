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
        "`drumstick lab beside-recordings`: each drum is struck five times, softest to hardest, at 0.3 of its radius, and compared with drum kits that",
        f"Debian packages for Hydrogen (some have 3 to 8 strokes). {where(found)}",
        "",
        "- softest, hardest: level of the bands 0.5-1, 1-2, 2-4, 4-8, 8-16 kHz relative to the whole stroke, dB",
        "- rise: of 1-8 kHz, from the softest stroke to the brightest",
        "- flatness: spectral flatness from 0.5 to 8 kHz, median of the strokes",
        "- T60: of the hardest stroke, in the octaves from 125 Hz to 8 kHz; -: not measurable",
        "- the last two: mean difference of band levels over all strokes, from the recording that the scene was tuned to, and from kits that nothing was",
        "  tuned to (median over all their drums of that kind, floor toms included)",
        "",
        "| drum | softest dB | hardest dB | rise dB | flatness | T60 s | distance from its recording, dB | distance from other kits, dB |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, drum in found["scenes"].items():
        made, away = drum["made_beside"], drum["distance_dB"]["work"]
        beside = f"{away[made]:.1f} ({made})" if made else "-"
        held = drum.get("median_held_out_dB")
        lines.append(_row(f"`{name}`", drum, beside, "-" if held is None else f"{held:.1f}"))
    for kind in found["recordings"].values():
        lines += [_row(f"{name} (recorded)", drum, "", "") for name, drum in kind["work"].items()]
    apart = [
        f"{pair} {value:.1f}"
        for kind in found["among_recordings_dB"].values()
        for pair, value in kind.items()
    ]
    return [*lines, "", f"The recordings among themselves, dB: {'; '.join(apart)}."]
