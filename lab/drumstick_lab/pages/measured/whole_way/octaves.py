"""Table of docs/accuracy-and-time.md: is a mesh too dull or too bright, octave by octave? Pure."""

from collections.abc import Iterator
from typing import Any

from drumstick_lab.accuracy.exact.differences import OCTAVES_Hz
from drumstick_lab.pages.measured.whole_way.set_ups import digits, row_of

_PLAYINGS = ("roll", "snare")
_TIERS = ("draft", "standard", "fine")


def _octave(centre_Hz: float) -> str:
    return f"{centre_Hz:g} Hz" if centre_Hz < 1000.0 else f"{1e-3 * centre_Hz:g} kHz"


def table(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Lines of the table in Markdown, dB."""
    heads = (
        "playing",
        "mesh",
        "louder as a whole",
        *map(_octave, OCTAVES_Hz),
        "differs below 4 kHz, made equally loud",
    )
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for playing in _PLAYINGS:
        for tier in _TIERS:
            row = row_of(rows, "drum", playing, tier)
            octaves = ("" if off_dB is None else f"{off_dB:+.1f}" for off_dB in row["octaves_dB"])
            cells = (playing, tier, f"{row['louder_dB']:+.1f}", *octaves, digits(row["alike_dB"]))
            yield f"| {' | '.join(cells)} |"
