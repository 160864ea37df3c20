"""Writes docs/measured.md from the stored results: python docs/tools/measured_page.py."""

import json
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent.parent
RESULTS = DOCS.parent / "benchmarks" / "results"
PAGE = DOCS / "measured.md"

_NAMES = {
    "python": "starting Python itself (baseline)",
    "imports": "Python with numba and zenoh imported (baseline)",
    "help": "`drumstick --help`",
    "back: sound": "sound server killed, until a strike sounds again",
    "back: panel": "panel killed, until it accepts browsers again",
    "back: gateway": "gateway killed, until its state is heard again",
    "back: servo": "servo killed, until it strikes again",
}


def _read(name: str) -> dict[str, Any]:
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def _where(result: dict[str, Any]) -> str:
    machine = result["machine"]
    return f"{machine['date']}, {machine['processor']}, {machine['cores']} cores, Python {machine['python']}."


def _streamed() -> list[str]:
    result = _read("streamed_force")
    lines = [
        "",
        "## A streamed force",
        "",
        f"`python benchmarks/streamed_force.py`, a blow of `roll` beside the analytic one. {_where(result)}",
        "",
        "| servo Hz | error of the sound below a quarter of that | below half | largest sample to the force's peak |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {rate} | {row['error_below_a_quarter']:.2%} | {row['error_below_half']:.2%} | {row['peak_of_samples']:+.2%} |"
        for rate, row in result["truth"].items()
    ]
    lines += ["", "| what | CPU time |", "|---|---|"]
    lines += [
        f"| {name} | {value:.0f} {unit} |"
        for (name, unit), value in ((what.rsplit(", ", 1), value) for what, value in result["cost"].items())
    ]
    return lines


def page() -> str:
    """The whole page."""
    starts, sound = _read("start_and_restart"), _read("sound_cost")
    lines = [
        "# What was measured",
        "",
        "Made by `docs/tools/measured_page.py` from `benchmarks/results/`; do not edit. The machines were shared and noisy:",
        "trust the ratios.",
        "",
        "## Starting, and coming back",
        "",
        f"`python benchmarks/start_and_restart.py`. {_where(starts)}",
        "",
        "| what | median s | worst s | times starting Python | times importing |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {_NAMES[name]} | {row['median']:.2f} | {row['max']:.2f} | {row['to_python']:.0f} | {row['to_imports']:.1f} |"
        for name, row in starts["rows"].items()
    ]
    lines += [
        "",
        "## What the drum's accuracy costs",
        "",
        f"`python benchmarks/sound_cost.py`, a {sound['f01_Hz']:g} Hz head at {sound['device_rate_Hz']} Hz. {_where(sound)}",
        "",
        "| `[mesh] accuracy` | junctions | mesh rate Hz | share of a core | ns a junction and step | cost to numpy slices | error of f01, cents |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['junctions']} | {row['mesh_rate_Hz']} | {row['share_of_core']:.1%} |"
        f" {row['ns_per_junction_and_step']:.2f} | {row['ratio_to_numpy_slices']:.2f} | {row['f01_error_cents']:+.2f} |"
        for name, row in sound["rows"].items()
    ]
    return "\n".join([*lines, *_streamed(), ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
