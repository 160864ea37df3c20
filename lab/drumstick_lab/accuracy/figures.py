"""The seven figures of `drumstick accuracy`: each an error, or what is gained, over what it costs on this machine."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from drumstick_lab.accuracy.choices import never
from rig.figures.style import (
    BLUE,
    DPI,
    GREEN,
    GREY,
    HEIGHT_IN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    WIDTH_IN,
    legend_below,
    save,
    sheet,
    styled,
)

Row = dict[str, Any]
_LEAST = 1e-16  # errors below rounding are drawn there
_MIN_CENTS = 1e-2
_MIN_JND = 1e-2
_METHODS = {
    "semi_implicit_euler": (VERMILION, "o", "semi-implicit Euler"),
    "verlet": (ORANGE, "s", "velocity Verlet"),
    "implicit_midpoint": (GREEN, "^", "implicit midpoint"),
    "rk4": (BLUE, "D", "Runge–Kutta 4"),
    "solve_ivp": (PURPLE, "v", "scipy, DOP853"),
    "solve_ivp, LSODA": (INK, "P", "scipy, LSODA"),
    "solve_ivp, Radau": (GREY, "X", "scipy, Radau"),
    "CVODE, Adams": (SKY, "<", "SUNDIALS CVODE, Adams"),
    "CVODE, BDF": (SKY, ">", "SUNDIALS CVODE, BDF"),
}
_SCHEMES = {
    "limit": (BLUE, "o", "triangular, at its limit"),
    "fourth": (GREEN, "^", "triangular, fourth order"),
    "lossless": (ORANGE, "s", "triangular, τ = 2"),
    "rectilinear": (VERMILION, "D", "rectilinear"),
}


def _drawn(rows: Iterable[Row], x: str, y: str) -> tuple[list[float], list[float]]:
    there = sorted((row[x], abs(row[y])) for row in rows if row[x] is not None and row[y] is not None)
    return [at for at, _ in there], [value for _, value in there]


def _log(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(visible=True, which="major", color=GREY, alpha=0.25, linewidth=0.6)


def _log_sheet(title: str, x_label: str, y_label: str, taller_in: float) -> tuple[Figure, Axes]:
    # Error, or what is gained, over its cost: both by decades.
    figure, axes = sheet(title, x_label, y_label, height_in=HEIGHT_IN + taller_in)
    _log(axes)
    return figure, axes


# Of a label from its point, in points: to the right of it and above it.
_PLACES = (
    (6, 3), (-6, 3), (-6, -4), (0, 7), (0, -13), (6, -10), (-6, -10),
    (0, -22), (0, 16), (12, 12), (-12, 12), (12, -18), (-12, -18),
    (6, 22), (-6, 22), (6, -26), (-6, -26), (0, 28), (0, -34),
)  # fmt: skip


def _is_free(axes: Axes, box: Bbox) -> bool:
    for line in axes.get_lines():
        path = line.get_transform().transform_path(line.get_path())
        half_a_mark = 0.5 * (line.get_markersize() + line.get_markeredgewidth()) * DPI / 72.0 + 1.0  # pixels
        if box.padded(half_a_mark).count_contains(path.vertices):
            return False
        if line.get_linestyle() != "None" and path.intersects_bbox(box.padded(2), filled=False):
            return False
    free = not any(box.overlaps(other.get_window_extent()) for other in axes.texts[:-1])
    return free and axes.get_window_extent().count_contains(box.corners()) == 4


def is_next_to(axes: Axes, box: Bbox, x: float, y: float) -> bool:
    """True when no other mark is as near to a label's box as its own, at (x, y)."""
    drawn = [line.get_xydata() for line in axes.get_lines() if line.get_marker() != "None"]
    marks = axes.transData.transform(np.concatenate(drawn))
    beyond = np.maximum(np.maximum(np.array(box.min) - marks, marks - np.array(box.max)), 0.0)
    own = np.hypot(*(marks - axes.transData.transform((x, y))).T) < 1.0
    far = np.hypot(*beyond.T)
    return bool(far[own].min() < far[~own].min(initial=np.inf))


def _label(figure: Figure, axes: Axes, labels: list[tuple[str, float, float]]) -> None:
    # When all else is drawn: each at the first place where it covers no mark, line or other label. Where another mark
    # is nearer, a thin line leads to its own.
    figure.draw_without_rendering()
    for words, x, y in labels:
        text = axes.annotate(words, (x, y), (0, 0), textcoords="offset points", fontsize=7)
        for place in _PLACES:
            text.set_position(place)
            text.set_horizontalalignment(("center", "left", "right")[(place[0] > 0) - (place[0] < 0)])
            if _is_free(axes, text.get_window_extent()):
                break
        box, mark = text.get_window_extent(), axes.transData.transform((x, y))
        if not is_next_to(axes, box, x, y):
            begin = (np.clip(mark, box.min, box.max) - mark) * 72.0 / DPI
            axes.annotate(
                "", (x, y), (begin[0], begin[1]), textcoords="offset points",
                arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 3.0},
            )  # fmt: skip


@styled
def stick(found: Row) -> Figure:
    """Error of the first ten contacts over the time that a second of the stick takes."""
    figure, axes = _log_sheet(
        "The stick: a time step buys accuracy by the decade, the exact motion has it all",
        "CPU time for one second of the stick, µs",
        "largest relative error of the first ten contacts",
        0.7,
    )
    for method, (colour, marker, words) in _METHODS.items():
        for locates, line, face in ((True, "-", colour), (False, ":", "white")):
            rows = [row for row in found["rows"] if row["method"] == method and row["locates"] == locates]
            ns, error = _drawn(rows, "ns_per_s", "error_contacts")
            if ns:
                axes.plot(
                    [1e-3 * each for each in ns], [max(each, _LEAST) for each in error], line,
                    color=colour, marker=marker, markersize=4.5, markerfacecolor=face, label=words if locates else None,
                )  # fmt: skip
            for row in rows:
                if row["error_contacts"] is not None:
                    low_ns, high_ns = row["median_ns"]
                    error = max(row["error_contacts"], _LEAST)
                    axes.hlines(error, 1e-3 * low_ns, 1e-3 * high_ns, color=colour, alpha=0.4, linewidth=3.0)
    axes.plot(
        [], [], ":", color=INK, marker="o", markersize=4.5, markerfacecolor="white", label="events unseen"
    )
    exact = next(row for row in found["rows"] if row["method"] == "exact")
    axes.axvline(
        1e-3 * exact["ns_per_s"], color=INK, linewidth=1.2, linestyle="--", label="exact: rounding only"
    )
    legend_below(figure, 3)
    return figure


@styled
def servo(found: Row) -> Figure:
    """Energy that the rendering adds over the servo's rate, led by its lag and not, for a softer and a harder head."""
    own = [row for row in found["rows"] if row["filter"] == found["rows"][0]["filter"]]
    stiffnesses = sorted({row["k_coll"] for row in own})
    shown = sorted({stiffnesses[len(stiffnesses) // 2], stiffnesses[-1]})
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN + 0.4), dpi=DPI, layout="constrained")
    panes: Any = figure.subplots(1, len(shown), sharey=True, squeeze=False)
    for at, k_coll in enumerate(shown):
        axes: Axes = panes[0][at]
        axes.set_title(f"K_coll {k_coll:g} N/m")
        _log(axes)
        rates: dict[float, float] = {}
        for predictor, colour, words in (("off", VERMILION, "as measured"), ("lead", BLUE, "led by its lag")):
            for delay, line in ((0, "-"), (1, "--"), (2, ":")):
                rows = sorted(
                    (
                        row for row in own
                        if (row["k_coll"], row["predictor"], row["delay_ticks"]) == (k_coll, predictor, delay)
                    ),
                    key=lambda row: row["rate_Hz"],
                )  # fmt: skip
                rates |= {row["rate_Hz"]: 100.0 * row["share_of_core"] for row in rows if not delay}
                label = f"{words}, {delay} ticks late" if at == 0 and rows else None
                x, y = [row["rate_Hz"] for row in rows], [row["energy"] for row in rows]
                axes.plot(x, [abs(each) for each in y], line, color=colour, linewidth=1.4, label=label)
                for row in rows:
                    axes.plot(
                        row["rate_Hz"], abs(row["energy"]), "o" if row["passes_envelope"] else "x",
                        color=colour, markerfacecolor=colour if row["energy"] > 0.0 else "white", markersize=4.5,
                    )  # fmt: skip
        axes.set_xticks(
            list(rates), [f"{rate:g} Hz\n{share:.2g} %" for rate, share in rates.items()], fontsize=8
        )
        axes.set_xticks([], minor=True)
        axes.set_xlabel("rate of the force loop, and its share of a core")
    panes[0][0].set_ylabel("energy that a contact adds, of that before it")
    panes[0][0].plot([], [], "o", color=INK, markerfacecolor="white", markersize=4.5, label="takes energy")
    panes[0][0].plot([], [], "x", color=INK, markersize=4.5, label="refused by the envelope")
    figure.suptitle(
        "The servo: what sampling adds, a higher rate or leading the position takes away",
        x=0.01, ha="left", fontsize=10.5,
    )  # fmt: skip
    legend_below(figure, 3)
    return figure


def _over_cost(axes: Axes, rows: list[Row], y: str, least: float) -> None:
    for scheme, (colour, marker, words) in _SCHEMES.items():
        # With the mesh's own rim: without it the lowest modes are far off, and dispersion is the same.
        own = [
            row for row in rows
            if row["scheme"] == scheme and row["precision"] == "float32" and row["rim"] != "none"
        ]  # fmt: skip
        ns, value = _drawn(own, "ns_per_sample", y)
        if ns:
            y_drawn = [max(each, least) for each in value]
            axes.plot(ns, y_drawn, color=colour, marker=marker, markersize=5, label=words)


@styled
def pitch(found: Row) -> Figure:
    """Error of the first twenty modes over the time of a sample: schemes, a bank of modes, other programs."""
    figure, axes = _log_sheet(
        "The drum’s pitch: what a sample costs, and how true its modes are",
        "CPU time of one sample at the device, ns",
        "rms error of the first twenty modes, cents",
        0.6,
    )
    _over_cost(axes, found["rows"], "rms_cents", _MIN_CENTS)
    labels: list[tuple[str, float, float]] = []
    for row in found["rows"]:
        if row["renderer"] == "mesh" or row["rms_cents"] is None or row["ns_per_sample"] is None:
            continue
        is_modal = row["renderer"] == "modal"
        cents = max(row["rms_cents"], _MIN_CENTS)
        marker, colour = ("*", PURPLE) if is_modal else ("X", INK)
        axes.plot(row["ns_per_sample"], cents, marker, color=colour, markersize=9)
        other = row["renderer"] + ("" if row["measured"] else ", stored")
        labels.append((f"{row['junctions']} modes" if is_modal else other, row["ns_per_sample"], cents))
    legend_below(figure, 3)
    _label(figure, axes, labels)
    return figure


@styled
def bandwidth(found: Row) -> Figure:
    """Up to where dispersion stays below 10 cents, over the time of a sample."""
    figure, axes = _log_sheet(
        "The drum’s brightness: how far up a mesh is in tune",
        "CPU time of one sample at the device, ns",
        "dispersion below 10 cents up to, Hz",
        0.4,
    )
    _over_cost(axes, [row for row in found["rows"] if row["renderer"] == "mesh"], "bandwidth_Hz", 1.0)
    legend_below(figure, 3)
    return figure


@styled
def excitation(found: Row) -> Figure:
    """Error of the sound against the contact law's own blow: by one message, and streamed at each rate."""
    figure, axes = sheet(
        "The blow: sent at once in one message, or streamed sample by sample, later",
        f"error of the sound against the exact blow below {found['band_Hz']:g} Hz, dB; further left is truer",
        "",
    )
    axes.grid(visible=True, axis="x", color=GREY, alpha=0.25, linewidth=0.6)
    rows = list(reversed(found["rows"]))
    for key, colour, face, words in (
        ("magnitude_error_dB", INK, "white", "magnitudes alone: no phase counts"),
        ("sound_error_dB", BLUE, BLUE, "sample by sample, the stream's constant delay taken off"),
    ):
        there = [(row[key], at) for at, row in enumerate(rows) if row.get(key) is not None]
        axes.plot(
            [value for value, _ in there], [at for _, at in there], "o",
            color=colour, markerfacecolor=face, markersize=7, label=words,
        )  # fmt: skip
    axes.set_yticks(range(len(rows)), [_blow_words(row) for row in rows])
    axes.set_ylim(-0.6, len(rows) - 0.4)
    legend_below(figure, 1)
    return figure


def _blow_words(row: Row) -> str:
    name = row["kind"] if row["rate_Hz"] is None else f"{row['kind']}, {row['rate_Hz']:g} Hz"
    return f"{name}\n{row['latency_ms']:.1f} ms, {row['bytes_per_strike']:.0f} bytes"


def _bars(axes: Axes, rows: list[Row], key: str, unit: str, words: Callable[[Row], str]) -> None:
    rows = sorted((row for row in rows if row["effect"] not in ("all", "none")), key=lambda row: row[key])
    spread = [row["spread_ns"] for row in rows]
    axes.barh(
        [row["effect"] for row in rows], [row[key] for row in rows], xerr=spread, ecolor=INK, color=BLUE, height=0.6
    )  # fmt: skip
    most = max((row[key] for row in rows), default=1.0)
    for at, row in enumerate(rows):
        axes.text(
            max(row[key] + row["spread_ns"], 0.0) + 0.01 * most, at, " " + words(row), va="center", fontsize=8
        )
    axes.set_xlim(right=2.1 * most)
    axes.set_xlabel(unit)


def _added(row: Row) -> str:
    return f"{round(row['added_ns']):+d} ± {row['spread_ns']:.0f} ns"


@styled
def effects(found: Row) -> Figure:
    """Time that each effect adds to a sample and to a tick, and the change when it is left out."""
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN + 1.6), dpi=DPI, layout="constrained")
    both: Any = figure.subplots(2, 1, height_ratios=(len(found["sample"]) + 1, len(found["tick"]) + 1))

    def of_sample(row: Row) -> str:
        heard = "" if row["changes_dB"] is None else f", change without it {row['changes_dB']:+.0f} dB"
        return f"{_added(row)}{heard}"

    def of_tick(row: Row) -> str:
        if row["rate_Hz"] is None:
            return _added(row)
        without = row["rate_without_Hz"]
        beside = "no roll without" if without is None else f"{without:.1f} Hz without"
        return f"{_added(row)}; a roll of {row['rate_Hz']:.1f} Hz, {beside}"

    both[0].set_title("The drum’s effects: what each adds, and what of the sound goes without it")
    _bars(both[0], found["sample"], "added_ns", "ns a sample at the device", of_sample)
    both[1].set_title("The stick’s effects: what each adds, and the roll with and without it")
    _bars(both[1], found["tick"], "added_ns", "ns a tick of the force loop", of_tick)
    return figure


_MALLETS = {
    "a blow by a wooden mallet": "wooden mallet", "a blow by a felt mallet on a timpano": "felt mallet (timpani)",
}  # fmt: skip
_LABELLED = ("roll", "timpani", "a blow of the roll", *_MALLETS)
_STAGES = {
    "stick": (VERMILION, "v"), "servo": (ORANGE, "s"), "message": (PURPLE, "D"), "drum": (BLUE, "o"),
}  # fmt: skip


def points(found: Row) -> list[Row]:
    """The rows of the whole way that are drawn: those that cost time."""
    return [row for row in found["rows"] if row["stage"] in _STAGES]


def point_id(found: Row, row: Row) -> str:
    """Name of a row's point in an SVG."""
    return f"choice-{points(found).index(row)}"


@styled
def whole(found: Row) -> Figure:
    """Error of each choice of the whole way, in JND, over its share of a core; what nobody should choose is hollow."""
    figure, axes = _log_sheet(
        "The whole way: what can be told apart, and what it costs",
        "share of a core, %",
        "largest error, in just noticeable differences",
        1.6,
    )
    axes.axhline(1.0, color=INK, linewidth=1.0, linestyle="--", label="just noticeable")
    refused = [row for row, _ in never(found["rows"])]
    labels: list[tuple[str, float, float]] = []
    for stage, (colour, marker) in _STAGES.items():
        rows = [row for row in found["rows"] if row["stage"] == stage]
        axes.plot([], [], marker, color=colour, markersize=6, label=stage)
        for row in rows:
            x, y = 100.0 * row["share_of_core"], max(row["jnds"], _MIN_JND)
            face = "white" if row in refused or row.get("refused") else colour
            axes.plot(
                x, y, marker, color=colour, markerfacecolor=face, markersize=6, gid=point_id(found, row)
            )
            # One playing of each kind of drum: the others lie beside it.
            if row["playing"] in _LABELLED or row["choice"] == "exact":
                tier = row["choice"].partition(",")[0]
                words = _MALLETS[row["playing"]] if row["playing"] in _MALLETS else row["choice"]
                labels.append((words if stage != "drum" else f"{tier} ({row['playing']})", x, y))
    axes.plot([], [], "o", color=INK, markerfacecolor="white", markersize=6, label="nobody should choose")
    legend_below(figure, 3)
    # Those of the drum first, among which most choose: they find the nearest places.
    _label(figure, axes, sorted(labels, key=lambda label: "(" not in label[0]))
    return figure


FIGURES: tuple[tuple[str, str, Callable[[Row], Figure]], ...] = (
    ("accuracy-stick", "stick", stick),
    ("accuracy-servo", "servo", servo),
    ("accuracy-pitch", "mesh", pitch),
    ("accuracy-bandwidth", "mesh", bandwidth),
    ("accuracy-excitation", "excitation", excitation),
    ("accuracy-effects", "effects", effects),
    ("accuracy-whole", "whole", whole),
)


def write(found: Row, out: Path) -> list[str]:
    """Draw what the result has, as PNG; returns the names. Raises OSError."""
    written: list[str] = []
    for name, part, draw in FIGURES:
        if found.get(part):
            save(draw(found[part]), out / f"{name}.png")
            written.append(f"{name}.png")
    return written
