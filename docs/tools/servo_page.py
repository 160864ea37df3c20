"""Writes docs/servo.md and its picture from the stored result: python docs/tools/servo_page.py."""

import json
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent.parent
RESULT = DOCS.parent / "benchmarks" / "results" / "rendered_restitution.json"
PAGE = DOCS / "servo.md"
PICTURE = DOCS / "images" / "servo-restitution.png"
SHOWN_RATE_HZ = 1000


def _result() -> dict[str, Any]:
    return json.loads(RESULT.read_text(encoding="utf-8"))


def _row(row: dict[str, Any]) -> str:
    theory = "below 0" if row["theory"] is None else f"{row['theory']:.3f}"
    cells = (
        f"{row['k_coll']:.0f}",
        f"{row['rate_Hz']}",
        f"{row['delay_ticks']}",
        f"{row['ticks_in_contact']:.0f}",
        f"{row['design']:.3f}",
        f"{row['lead']['mean']:.3f}",
        f"{row['off']['mean']:.3f}",
        theory,
        f"{row['lead']['guarded_most']:.3f}",
        f"{row['off']['guarded_most']:.3f}",
        "yes" if row["passes_envelope"] else "refused",
    )
    return f"| {' | '.join(cells)} |"


def page() -> str:
    """The whole page."""
    result = _result()
    machine = result["machine"]
    lines = [
        "# What a sampled device gives back",
        "",
        "Made by `docs/tools/servo_page.py` from `benchmarks/results/rendered_restitution.json`; do not edit.",
        "",
        "A motor arm tells its position at ticks and holds its force until the next. A head computed that way answers T/2 late, and",
        "by the device's own delay t_d besides; a late spring gives back more than it took, as if its damping were",
        "R_eff = R_in - K_coll (T/2 + t_d). The servo therefore leads the position by T/2 + t_d (`[servo] predictor`).",
        "",
        "![Coefficient of restitution against stiffness](images/servo-restitution.png)",
        "",
        f"A simulated arm of {result['m_kg'] * 1e3:.0f} g (encoder counts of 0.03 mm, no hand, no friction) falls on the head at "
        f"{result['speed_m_per_s']:g} m/s,",
        f"R_in {result['r_in']:g} N s/m, 32 phases of the tick; `python benchmarks/rendered_restitution.py`, {machine['date']}. The guard's",
        "energy account is off but for the two columns that say so: there, the fastest rebound of all phases.",
        "",
        "| K_coll N/m | rate Hz | delay ticks | ticks in contact | design | predicted: mean | not predicted: mean | theory of lag | guarded, predicted | guarded, not predicted | envelope |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(_row(row) for row in result["rows"]),
        "",
        "What to choose: the highest rate that `drumstick servo-test` calls fit, prediction on, and a stiffness whose contact lasts ten ticks.",
        "The envelope refuses what lag alone would make active, without credit for the prediction, at the gateway and again in the servo;",
        "the guard holds back what still gives more than it took.",
        "",
    ]
    return "\n".join(lines)


def draw() -> None:
    """The picture: restitution over stiffness at 1 kHz, without and with a tick of delay."""
    from matplotlib.figure import Figure

    from rig.figures.style import BLUE, GREEN, GREY, INK, VERMILION, styled

    rows = [row for row in _result()["rows"] if row["rate_Hz"] == SHOWN_RATE_HZ]
    with styled:
        figure = Figure(figsize=(7.2, 3.6), dpi=140, layout="constrained")
        for axes, delay in zip(figure.subplots(1, 2, sharey=True), (0, 1), strict=True):
            shown = [row for row in rows if row["delay_ticks"] == delay]
            k = [row["k_coll"] for row in shown]
            axes.axhspan(1.0, 1.5, color="#f6dcd0", zorder=0)
            axes.axhline(1.0, color=VERMILION, lw=0.8)
            axes.plot(k, [row["design"] for row in shown], color=INK, label="design")
            lag = [row for row in shown if row["theory"] is not None]
            axes.plot(
                [r["k_coll"] for r in lag],
                [r["theory"] for r in lag],
                color=GREY,
                ls="--",
                label="theory of lag",
            )
            for key, colour, mark, words in (
                ("off", VERMILION, "s", "not predicted"),
                ("lead", BLUE, "o", "predicted"),
            ):
                mean = [row[key]["mean"] for row in shown]
                low = [row[key]["mean"] - row[key]["least"] for row in shown]
                high = [row[key]["most"] - row[key]["mean"] for row in shown]
                axes.errorbar(
                    k, mean, (low, high), color=colour, marker=mark, ms=4, lw=0, elinewidth=1.4, label=words
                )
            refused = [row for row in shown if not row["passes_envelope"]]
            axes.plot(
                [row["k_coll"] for row in refused], [0.42] * len(refused), ls="", marker="x", color=GREEN,
                label="refused by the envelope",
            )  # fmt: skip
            axes.set_title(f"1 kHz, {'no delay' if delay == 0 else 'a tick of delay'}")
            axes.set_xlabel("K_coll, N/m")
            axes.set_ylim(0.38, 1.42)
        figure.axes[0].set_ylabel("coefficient of restitution")
        figure.axes[0].text(300.0, 1.05, "gives more than it took", color=VERMILION, fontsize=9)
        handles, labels = figure.axes[1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
        figure.savefig(PICTURE)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    draw()
