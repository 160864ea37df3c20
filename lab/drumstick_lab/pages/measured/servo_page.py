"""Writes docs/servo.md and its pictures from the stored results: drumstick lab servo-page."""

from typing import Any

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read
from drumstick_lab.pages.measured import servo_region

PAGE = DOCS / "servo.md"
PICTURE = DOCS / "images" / "servo-restitution.png"
SPEED_PICTURE = DOCS / "images" / "servo-velocity.png"
SHOWN_RATE_HZ = 1000


def _row(row: dict[str, Any]) -> str:
    theory = "none, R_eff < 0" if row["theory"] is None else f"{row['theory']:.3f}"
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


def _speed() -> list[str]:
    result = read("velocity_estimate")
    ours, plain = list(result["rows"].values())[:2]
    lines = [
        *heading("## How fast does it move?", "velocity_estimate"),
        "Encoders tell positions only. The difference of two is late by half a tick but jumps by whole counts: one count of"
        f" {result['count_m'] * 1e3:g} mm a",
        f"tick is {result['count_m'] / result['period_s'] * 1e3:g} mm/s, which the head's damper turns into a force that one feels as"
        " roughness. A longer window is less noisy but lags",
        "more; a lagging damper adds energy that it should remove. The servo's window (`services/haptic_server/servo/force/velocity.py`) is as long as a straight",
        "line explains the positions to one count: long at rest, short where the stick turns.",
        "",
        "![Noise of the estimated speed over its lag](images/servo-velocity.png)",
        "",
        f"`drumstick lab velocity-estimate`: {1e-3 / result['period_s']:g} kHz, held still with the noise of"
        f" {result['noise_counts']:g} counts; moved evenly at about",
        f"{result['speed_m_per_s']:g} m/s; a blow at {result['speed_m_per_s']:g} m/s whose contact lasts {result['contact_s'] * 1e3:.1f} ms."
        " The lag is the delay that best fits the estimated to the true velocity during the contact.",
        "",
        "| estimate | still, mm/s rms | moving evenly, mm/s rms | lag in a blow, ms | error in a blow, mm/s rms |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {name} | {row['still_rms_m_per_s'] * 1e3:.1f} | {row['steady_rms_m_per_s'] * 1e3:.1f} | {row['lag_s'] * 1e3:.2f} |"
        f" {row['blow_rms_m_per_s'] * 1e3:.0f} |"
        for name, row in result["rows"].items()
    ]
    return [
        *lines,
        "",
        f"At rest the servo's estimate is {plain['still_rms_m_per_s'] / ours['still_rms_m_per_s']:.0f} times calmer than the plain difference, in a"
        f" blow {(ours['lag_s'] - plain['lag_s']) * 1e3:.2f} ms later. A filter that is as calm is late by",
        "several milliseconds, a large part of the contact.",
        "",
    ]


def page() -> str:
    """The whole page."""
    result = read("rendered_restitution")
    lines = [
        *heading(
            "# The head on a sampled device: restitution, velocity estimate, stability",
            "rendered_restitution",
        ),
        "Made by `drumstick lab servo-page` from `rendered_restitution.json`, `velocity_estimate.json`, `region.json`",
        "and `held_arm.json` in `lab/results`; do not edit.",
        "",
        "A motor arm is read at each tick and holds its force until the next (zero-order hold). The rendered force so lags by T/2, T being",
        "the tick's period, plus the device's own delay t_d. A delayed spring generates energy; to first order its effective damping is",
        "R_eff = R_in - K_coll (T/2 + t_d). The servo therefore leads the position by T/2 + t_d (`[servo] predictor`).",
        "",
        "![Coefficient of restitution against stiffness](images/servo-restitution.png)",
        "",
        f"A simulated arm of {result['m_kg'] * 1e3:.0f} g (encoder counts of 0.03 mm, no hand, no friction) falls on the head at "
        f"{result['speed_m_per_s']:g} m/s,",
        f"R_in {result['r_in']:g} N s/m, 32 phases of the tick; `drumstick lab rendered-restitution`.",
        "The six columns before the last are coefficients of restitution. The guard's passivity control is on in the two that say so.",
        "",
        "| K_coll N/m | rate Hz | delay ticks | ticks in contact | ideal head | predictor on, mean over phases | predictor off, mean over phases | predictor off, closed form with R_eff | guard and predictor on, largest over phases | guard on, predictor off, largest over phases | accepted by the envelope |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        *(_row(row) for row in result["rows"]),
        "",
        "What to choose: the highest rate that `drumstick servo-test` calls fit, prediction on, and a stiffness whose contact lasts ten ticks.",
        "The envelope refuses every set with R_in <= K_coll (T/2 + t_d), even with prediction on, and by the other rules below, at the gateway and again in the servo;",
        "the guard holds back what still gives more than it took.",
        "",
        *_speed(),
        *servo_region.section(),
    ]
    return "\n".join(lines)


def _draw_restitution() -> None:
    # Restitution over stiffness at 1 kHz, without and with a tick of delay.
    from matplotlib.figure import Figure

    from rig.figures.style import BLUE, GREEN, GREY, INK, VERMILION

    rows = [row for row in read("rendered_restitution")["rows"] if row["rate_Hz"] == SHOWN_RATE_HZ]
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


def _draw_speeds() -> None:
    # Noise over lag, every estimate of speed.
    from matplotlib.figure import Figure

    from rig.figures.style import BLUE, DPI, GREY, INK, VERMILION, scaled

    rows = read("velocity_estimate")["rows"]
    ours = next(iter(rows))
    figure = Figure(figsize=(7.2, 3.8), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    for key, colour, mark, words in (
        ("still_rms_m_per_s", BLUE, "o", "held still"),
        ("steady_rms_m_per_s", VERMILION, "s", "moving evenly"),
    ):
        lags = [1e3 * row["lag_s"] for row in rows.values()]
        noise = [1e3 * row[key] for row in rows.values()]
        axes.plot(lags, noise, color=colour, marker=mark, ms=6, lw=0, label=words)
        axes.plot(lags[0], noise[0], color=INK, marker="o", ms=13, mfc="none", lw=0)
    for name, row in rows.items():
        top = 1e3 * max(row["still_rms_m_per_s"], row["steady_rms_m_per_s"])
        low = 1e3 * min(row["still_rms_m_per_s"], row["steady_rms_m_per_s"])
        axes.plot([1e3 * row["lag_s"]] * 2, [low, top], color=GREY, lw=0.8, zorder=0)
        words, at = ("the servo's", (12, 0)) if name == ours else (name, (8, 4))
        axes.annotate(words, (1e3 * row["lag_s"], top), at, textcoords="offset points", fontsize=9)
    scaled(axes, "y", "log")
    axes.set_xlim(0.0, 8.5)
    axes.set_xlabel("lag of the estimate in a blow, ms")
    axes.set_ylabel("noise of the estimate, mm/s rms")
    axes.legend(loc="upper right")
    figure.savefig(SPEED_PICTURE)


def draw() -> None:
    """All pictures."""
    from rig.figures.style import styled

    styled(_draw_restitution)()
    styled(_draw_speeds)()
    styled(servo_region.draw)()


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    draw()
