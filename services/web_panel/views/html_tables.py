"""HTML of the views that are tables: what things cost, how all is. What came over the network is escaped here. Pure."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from protocol.announced import Report, sentence
from protocol.messages import Cost, Meter, State
from web_panel.computing.computing_messages import Ticks, Trouble
from web_panel.page.wording import figure, microseconds


def _table(part: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<table class="dr-table" data-part="{part}"><tr>{head}</tr>{body}</table>'


def _small(part: str, words: str) -> str:
    return f'<div class="dr-small" data-part="{part}">{escape(words)}</div>'


def _percent(share: float) -> str:
    return f"{figure(100.0 * share, 2)} %"


def _stick(ticks: Ticks | Trouble | None) -> str:
    if ticks is None:
        return _small("tick-cost", "The stick: being measured …")
    if isinstance(ticks, Trouble):
        return _small("tick-cost", f"The stick could not be measured: {ticks.why}")
    ns, rate_Hz = ticks.ns, ticks.rate_Hz
    whole = ns["all"]
    parts = [("all of it", whole), ("without any effect", ns["none"])]
    parts += [(f"of that {name}", whole - ns[name]) for name in ns if name not in ("all", "none")]
    rows = [(words, f"{cost_ns:.0f} ns", _percent(cost_ns * 1e-9 * rate_Hz)) for words, cost_ns in parts]
    return _table("tick-cost", ("The stick", "a tick", f"of a tick at {rate_Hz:g} Hz"), rows) + _small(
        "tick-where",
        "Measured just now on the machine that serves this page, beside everything else that it does.",
    )


def _drum(costs: Mapping[str, Cost], load: tuple[float, float] | None) -> str:
    now = costs.get("now")
    if now is None:
        return _small("drum-cost", "The drum: no sound server reports its cost.")

    def of_a_block(cost: Cost) -> str:
        if load is None:
            return "–"
        return ("" if cost is now else "about ") + _percent(load[0] * cost.share)

    taken = ""
    if load is not None:
        taken = (
            f" It takes {_percent(load[0])} of an audio block while it sounds, at most {_percent(load[1])}."
        )
    found = _small("drum-now", f"The drum: {now.words}.{taken}")
    if len(costs) == 1:
        return found
    rows = [
        (
            "this scene" if cost is now else cost.accuracy,
            f"{figure(cost.mesh_rate_Hz / 1e3, 3)} kHz",
            f"{cost.across:.0f}",
            of_a_block(cost),
            f"{cost.cents:.1f} cents",
        )
        for cost in costs.values()
    ]
    heads = ("Mesh", "rate", "across", "of a block", "pitch")
    return (
        found
        + _table("drum-cost", heads, rows)
        + _small(
            "drum-how",
            "Pitch: the rms error of the first twenty modes. What another accuracy costs is reckoned from its "
            "number of junctions, effects included; “drumstick scene cost” measures each.",
        )
    )


def cost(ticks: Ticks | Trouble | None, drum: Mapping[str, Cost], load: tuple[float, float] | None) -> str:
    """Table of what the stick and the drum cost, and what accuracy that buys.

    `ticks`: ns a tick by what is left out; `drum`: by accuracy; load: shares of a block while the drum
    sounds, the usual and the largest of the last ten seconds.
    """
    return f'<div class="dr">{_drum(drum, load)}{_stick(ticks)}</div>'


def _network(meters: Sequence[Meter]) -> str:
    rows = [
        (
            meter.sink,
            f"{meter.arrival_ms:.2f} ms",
            f"{meter.jitter_ms:.2f} ms",
            f"{meter.late + meter.unpunctual} of {meter.played + meter.late}",
            str(meter.underflows),
            str(meter.xruns),
        )
        for meter in meters
    ]  # fmt: skip
    heads = ("Sound", "arrival", "jitter", "late", "gaps", "xruns")
    return _table("network", heads, rows) if rows else _small("network", "No sound server is heard.")


def _present(present: Iterable[str], browsers: int) -> str:
    services = [token.partition("/")[0] for token in present]
    words = ", ".join(f"{services.count(name)} {name}" for name in sorted(set(services)))
    return _small(
        "present",
        f"Connected: {words or 'nobody'}; {browsers} {'browser' if browsers == 1 else 'browsers'} on this page.",
    )


def _servo(doctor: Mapping[str, Any] | None, state: State | None) -> str:
    words = ["Servo: no data"]
    if state is not None:
        words = [
            f"Servo: {state.overruns} ticks missed of {state.ticks}",
            f"99 % less than {microseconds(state.lateness_p99_us)} late",
            f"the worst {microseconds(state.lateness_worst_us)}",
        ]
    if doctor is None:
        words.append("the haptic server does not answer “doctor”")
    return _small("lateness", ", ".join(words) + ".")


def health(
    meters: Sequence[Meter],
    present: Iterable[str],
    browsers: int,
    doctor: Mapping[str, Any] | None,
    state: State | None,
    announced: Report | None,
) -> str:
    """Table of connections, the network's effect on strikes, their accuracy, and the ticks' lateness."""
    found = _present(present, browsers) + _network(meters) + _small("announced", sentence(announced))
    return f'<div class="dr">{found}{_servo(doctor, state)}</div>'
