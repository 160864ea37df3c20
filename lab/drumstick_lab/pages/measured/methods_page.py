"""Writes docs/methods.md and its picture from the stored results: drumstick lab methods-page."""

import math
from typing import Any

from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.provenance import heading
from drumstick_lab.measuring.stored import read

PAGE = DOCS / "methods.md"
PICTURE = DOCS / "images" / "methods-work-precision.png"

Table = dict[str, Any]
_WANTED = (1e-2, 1e-3, 1e-6, 1e-9)
_NAMES = {
    "semi_implicit_euler": "semi-implicit Euler",
    "verlet": "Verlet",
    "rk4": "RK4",
    "implicit_midpoint": "implicit midpoint",
}
_SHOWN = {"roll": "`roll`: release at z = 0", "unilateral": "`roll` with a head that only pushes"}


def _power(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")


def _scipy_us_per_s(result: Table, scene: str) -> list[tuple[float, float]]:
    # (CPU µs for a simulated second, error) at each tolerance.
    rate = result["over_step"][scene]["bounces_per_s"]
    return [(row["us"] * rate, row["error"]) for row in result["over_tolerance"][scene]]


def _against_scipy(result: Table) -> list[str]:
    asked = result["solve_ivp"]
    rows = result["against_scipy"].values()
    lines = [
        f"The same bounces by `exact` and by scipy's `solve_ivp` ({asked['METHOD']}, terminal events, rtol {asked['RTOL']:g}),",
        "CPU time a bounce, and the largest relative error of any instant or speed of the first"
        f" {min(row['bounces'] for row in rows)} to {max(row['bounces'] for row in rows)} contacts",
        "against a solution to 40 digits:",
        "",
        "| what is played | `exact` µs | `solve_ivp` µs | times faster | error of `exact` | error of `solve_ivp` |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['words']} | {row['exact_us']:.2f} | {row['solve_ivp_us']:.0f} | {row['ratio']:.0f} |"
        f" {_power(row['exact_error'])} | {_power(row['solve_ivp_error'])} |"
        for row in rows
    ]
    return lines


def _same_time(result: Table, scene: str) -> float:
    # The least error of a stepper that takes no more time than `exact`.
    swept = result["over_step"][scene]
    quick = [row for row in swept["steppers"] if row["us_per_s"] <= swept["exact"]["us_per_s"]]
    return min(row["error"] for row in quick if row["error"] is not None)


def _least(result: Table, scene: str) -> float:
    return min(row["error"] for row in result["over_step"][scene]["steppers"] if row["error"] is not None)


def _cheapest(result: Table, scene: str, wanted: float, locates: bool) -> str:
    exact_us = result["over_step"][scene]["exact"]["us_per_s"]
    good = [
        row
        for row in result["over_step"][scene]["steppers"]
        if row["locates"] == locates and row["error"] is not None and row["error"] <= wanted
    ]
    if not good:
        return "none of the steps down to 1 µs"
    best = min(good, key=lambda row: row["us_per_s"])
    times = best["us_per_s"] / exact_us
    return f"{_NAMES[best['method']]}, {best['dt_s'] * 1e6:g} µs: {best['us_per_s']:.0f} µs ({times:.1f} × `exact`)"


def _by_scipy(result: Table, scene: str, wanted: float) -> str:
    exact_us = result["over_step"][scene]["exact"]["us_per_s"]
    good = [spent for spent, error in _scipy_us_per_s(result, scene) if error <= wanted]
    return f"{min(good) / 1e3:.0f} ms ({min(good) / exact_us:.0f} × `exact`)" if good else "no tolerance"


def _work_precision(result: Table) -> list[str]:
    scene = "roll"
    exact = result["over_step"][scene]["exact"]
    lines = [
        "## Error against time",
        "",
        "![Error over CPU time, all methods](images/methods-work-precision.png)",
        "",
        "Every point is one time step (or one tolerance of `solve_ivp`): how much CPU time a second of playing takes, and how wrong it",
        "then is. *Located* steppers cut a step where the stick meets or leaves the head, and so keep the order of their method.",
        "The others notice an event at the end of the step that saw it, as most force loops do: all of them are of order one,",
        "whatever their name, and a finer method buys nothing. Steps with which the roll dies, or grows to another, are not",
        f"shown: their error has no size. RK4 comes no nearer than {_power(_least(result, scene))}: that is the rounding of all its steps.",
        "",
        "Times and ratios are of the run named above; [accuracy-and-time.md](accuracy-and-time.md) tells of another one.\n"
        f"The cheapest way to an error, scene `roll`, CPU time for a second of playing (`exact`: {exact['us_per_s']:.0f} µs,"
        f" error {_power(exact['error'])}):",
        "",
        "| error at most | with event location | without | `solve_ivp` |",
        "|---|---|---|---|",
    ]
    return lines + [
        f"| {_power(wanted)} | {_cheapest(result, scene, wanted, True)} | {_cheapest(result, scene, wanted, False)} |"
        f" {_by_scipy(result, scene, wanted)} |"
        for wanted in _WANTED
    ]


def _tick_us(result: Table, scene: str, rate: str) -> float:
    # What one tick that cuts a bounce costs more.
    limits = result["limits"][scene]
    ticks = float(rate) / result["over_step"][scene]["bounces_per_s"]
    return (limits["ticked_us"][rate] - limits["exact_us"]) / ticks


def _time(result: Table) -> list[str]:
    scene = "roll"
    limits, row = result["limits"][scene], result["against_scipy"][scene]
    event_ns = limits["exact_us"] * 1e3 / row["events_per_bounce"]
    points = event_ns / limits["point_ns"]
    ticked = limits["ticked_us"]["1000"]
    return [
        "## What the time of `exact` is spent on",
        "",
        f"A bounce of `roll` has {row['events_per_bounce']:.0f} events: the highest point, the contact, the deepest point, the release. Each costs"
        f" about {event_ns:.0f} ns.",
        f"The unit is a *point*: height, speed and their derivatives at one instant in closed form, {limits['point_ns']:.0f} ns with a pulse going"
        " on",
        f"(an exponential, a sine and a cosine, and an exponential for the pulse). An event costs as much as {points:.0f} points: those at which",
        "it is bracketed and found, a handful; the zeros of the free motion that tell how far one may look without missing",
        "anything; and what happens at it: pulses, the contact's impulse, whether the stick can still come out, or back.",
        "No search can do with less than one point for each event, so what is left to gain is a factor of some"
        f" {math.floor(points)}, not of hundreds.",
        "",
        "What a servo pays more is its ticks, because each must know where the stick is: at 1 kHz a bounce takes"
        f" {ticked:.1f} µs instead of",
        f"{limits['exact_us']:.1f}, that is {_tick_us(result, scene, '1000'):.2f} µs a tick, and {_tick_us(result, scene, '10000'):.2f} µs at"
        " 10 kHz. So in the live rig time grows with the servo's rate; off-line",
        "it grows with the number of contacts only.",
        "",
        f"A head that only pushes lets go before z = 0, one event more to look for: {result['limits']['unilateral']['exact_us']:.1f} µs a bounce.",
    ]


def _error(result: Table) -> list[str]:
    limits = result["limits"]
    counts = ["1 contact" if count == "1" else f"{count} contacts" for count in limits["roll"]["error_after"]]
    lines = [
        "## What its error is made of",
        "",
        "There is no error of method: no step, no tolerance. What is left is rounding. A double holds a number to 1.1e-16 of itself; each",
        "contact adds a few such roundings, and a stable roll forgets those of its speed (its multiplier is below 1), while those of",
        "the instants add up slowly:",
        "",
        f"| error after | {' | '.join(counts)} |",
        f"|---|{'---|' * len(counts)}",
    ]
    lines += [
        f"| {_SHOWN[scene]} | {' | '.join(f'{e:.1e}' for e in limits[scene]['error_after'].values())} |"
        for scene in limits
    ]
    worst = max(result["against_scipy"].values(), key=lambda row: row["exact_error"])
    return [
        *lines,
        "",
        "Where the stick is about to be captured, speeds are small differences of larger ones, and the same roundings weigh more:"
        f" {_power(worst['exact_error'])}",
        f"in the table above ({worst['words']}). Nearer to the truth one can only come with more digits, not with more time.",
        "",
        "All this is about the equations. Whether a stick obeys them, and what a sampled device makes of them, are other questions:",
        "[servo.md](servo.md) for the device; there a tick's lag is worth per cents, where `exact` is off by parts in 10^15.",
    ]


def _effects(cost: Table) -> list[str]:
    lines = [
        *heading("## What effects cost a step", "step_cost"),
        "Kernels are put together from the effects that the scene names; what it does not name leaves no instruction and no byte. Against a",
        f"loop in which the same is written out by hand, {cost['dt_s'] * 1e6:.1f} µs steps of semi-implicit Euler,"
        " the same result to the last bit:",
        "",
        "| effects | by hand, ns a step | composed, ns | ratio |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {row['words']} | {row['plain_ns']:.2f} | {row['composed_ns']:.2f} | {row['ratio']:.2f} |"
        for row in cost["races"].values()
    ]
    lines += [
        "",
        "Each effect alone, against the same stick without; bytes that it adds to the scene's parameters and to the stick's state:",
        "",
        "| effect | without, ns | with, ns | bytes of parameters | bytes of state |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| `{name}` | {row['without_ns']:.2f} | {row['with_ns']:.2f} | {row['law_bytes']} | {row['motion_bytes']} |"
        for name, row in cost["alone"].items()
    ]
    return [
        *lines,
        "",
        "With `system_delay` the head's force is a held sample, whose sign nobody has to watch: a shorter step.",
    ]


def page() -> str:
    """The whole page."""
    result, cost = read("stick_methods"), read("step_cost")
    ratios = [row["ratio"] for row in result["against_scipy"].values()]
    lines = [
        *heading("# What accuracy costs: the stick", "stick_methods"),
        "Made by `drumstick lab methods-page` from `lab/results/stick_methods.json` and `step_cost.json`; do not edit. Measured by",
        "`drumstick lab stick-methods` and `drumstick lab step-cost`; CPU time of the thread, windows of all methods in turn, the best of each. The machine was shared: trust the ratios.",
        "",
        f"In short: the method `exact` plays a bounce in about {result['limits']['roll']['exact_us']:.0f} µs with an error of 1e-15,"
        f" {math.floor(min(ratios) / 100) * 100} to {math.ceil(max(ratios) / 100) * 100} times faster than",
        f"`solve_ivp` with an error of 1e-10. No stepper that takes as little time is less wrong than"
        f" {_same_time(result, 'roll'):.0%} (scene `roll`). There is",
        "nothing to trade: that is why no scene asks for a step.",
        "",
        *_against_scipy(result),
        "",
        *_work_precision(result),
        "",
        *_time(result),
        "",
        *_error(result),
        "",
        *_effects(cost),
        "",
    ]
    return "\n".join(lines)


def _curve(axes: Any, points: list[tuple[float, float]], **style: Any) -> None:
    axes.plot([1e3 * spent for spent, _ in points], [error for _, error in points], **style)


def _panel(axes: Any, result: Table, scene: str) -> None:
    from rig.figures.style import BLUE, GREEN, GREY, INK, ORANGE, VERMILION

    looks = {
        "semi_implicit_euler": (VERMILION, "o"),
        "verlet": (GREEN, "s"),
        "implicit_midpoint": (ORANGE, "D"),
        "rk4": (BLUE, "^"),
    }
    swept = result["over_step"][scene]
    for method, (colour, mark) in looks.items():
        for locates in (True, False):
            points = [
                (row["us_per_s"], row["error"])
                for row in swept["steppers"]
                if row["method"] == method and row["locates"] == locates and row["error"] is not None
            ]
            _curve(
                axes, points, color=colour, marker=mark, ms=4.5, lw=1.3, ls="-" if locates else ":",
                mfc=colour if locates else "white",
                label=f"{_NAMES[method]}{', located' if locates else ''}",
            )  # fmt: skip
    _curve(
        axes,
        _scipy_us_per_s(result, scene),
        color=GREY,
        marker="v",
        ms=5,
        lw=1.3,
        label="scipy's solve_ivp, located",
    )
    _curve(
        axes,
        [(swept["exact"]["us_per_s"], swept["exact"]["error"])],
        color=INK,
        marker="*",
        ms=13,
        lw=0,
        label="exact",
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(8e3, 3e8)
    axes.set_ylim(2e-16, 1.0)
    axes.set_title(_SHOWN[scene].replace("`", ""))
    axes.set_xlabel("CPU time for a second of playing, ns")
    axes.grid(True, color="#e6e6e6", lw=0.6)


def draw() -> None:
    """The picture: error over CPU time, all methods, two heads."""
    from matplotlib.figure import Figure

    from rig.figures.style import DPI, styled

    result = read("stick_methods")
    with styled:
        figure = Figure(figsize=(8.6, 5.2), dpi=DPI, layout="constrained")
        for axes, scene in zip(figure.subplots(1, 2, sharey=True), _SHOWN, strict=True):
            _panel(axes, result, scene)
        figure.axes[0].set_ylabel("largest relative error of 8 contacts")
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        figure.savefig(PICTURE)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    draw()
