"""Numbers and states in words a technician reads from three metres. Pure; results are plain text, not HTML."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import Quantity
from drumstick.scenes.table import Parameter
from drumstick.stick.law import DRUM
from protocol.keys import command
from protocol.messages import Meter, Readback, State
from web_panel.computing.computing_messages import PredictedRoll

Mood = Literal["wait", "good", "busy", "bad"]
_SILENT = 10.0 ** (-90.0 / 20.0)
_CHANGING_S = 30.0  # a systemd service that starts anew for another scene is not heard for so long


@dataclass(frozen=True)
class Notice:
    """A headline, what to do next, and how it should look."""

    headline: str
    advice: str
    mood: Mood


def figure(value: float, digits: int = 4) -> str:
    """A number with so many significant digits and no superfluous zeros: 5000, 0.2, 23.05, 1.2e-05."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if not -4 <= size <= 6:
        return f"{value:.{max(digits - 2, 1)}g}"
    text = f"{value:.{max(0, digits - 1 - size)}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return text.replace("-", "−")


def measured(value: float, unit: str, digits: int = 4) -> str:
    """A number with its unit."""
    return f"{figure(value, digits)} {unit}" if unit not in ("", "1") else figure(value, digits)


# One and many of each; a symbol that is not here is spoken as it is written.
_SPOKEN = {
    "m": ("metre", "metres"),
    "s": ("second", "seconds"),
    "kg": ("kilogram", "kilograms"),
    "g": ("gram", "grams"),
    "N": ("newton", "newtons"),
    "Hz": ("hertz", "hertz"),
    "dB": ("decibel", "decibels"),
}
_POWERS = {"2": " squared", "3": " cubed"}


def _spoken(symbol: str, many: bool) -> str:
    base, _, power = symbol.partition("^")
    if base not in _SPOKEN or (power and power not in _POWERS):
        return symbol
    return _SPOKEN[base][many] + _POWERS.get(power, "")


def spoken_unit(unit: str) -> str:
    """A unit as it is read aloud: `m/s` is "metres per second", `N s/m` "newton seconds per metre"; "" for none."""
    above, _, below = ("" if unit == "1" else unit).partition("/")
    words = [_spoken(symbol, many=False) for symbol in above.split()]
    if words:
        words[-1] = _spoken(above.split()[-1], many=True)
    return " ".join([*words, *(f"per {_spoken(symbol, many=False)}" for symbol in below.split())])


def steady(value: float, decimals: int) -> str:
    """A number that changes all the time, with fixed decimals so that it does not jump about."""
    return f"{value:.{decimals}f}".replace("-", "−") if math.isfinite(value) else "–"


def decibels(level: float) -> str:
    """Whole dB of full scale of a linear level; a dash where it is below -90 dB, or not told."""
    return f"{steady(round(20.0 * math.log10(level)), 0)} dB" if _SILENT < level < math.inf else "–"


def microseconds(value: float) -> str:
    """A lateness: µs up to 1 ms, then ms, then s."""
    if value < 1000.0:
        return f"{value:.0f} µs"
    return f"{value / 1e3:.1f} ms" if value < 1e6 else f"{value / 1e6:.1f} s"


def range_of(quantity: Quantity) -> str:
    """The table's range with its unit."""
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    return f"{figure(quantity.low)} .. {figure(quantity.high)}{unit}"


def hint_of(parameter: Parameter) -> str:
    """Words, unit, range, equation, and when it takes effect: what a control says when pointed at."""
    q = parameter.quantity
    parts = [f"{q.words}.", f"Wire name {parameter.name}, {range_of(q)}; the envelope may allow less."]
    if q.equation:
        parts.append(f"Equation {q.equation}.")
    if parameter.effect == DRUM:
        if q.rebuilds:
            parts.append(
                "It changes only the sound. Another drum is built for it, which takes over when it is ready."
            )
        else:
            parts.append("It changes only the sound, so it takes effect at once.")
        return " ".join(parts)
    if parameter.effect:
        parts.append(f"Part of the effect {parameter.effect}.")
    if q.above_head_only:
        parts.append("Takes effect while the stick is above the head.")
    return " ".join(parts)


def readback_note(readback: Readback | None, waits: bool = False) -> str:
    """Note beside a readback, with `waits` of a set accepted but not taken yet; empty when it holds."""
    if readback is None:
        return "no data yet"
    return "waits until the stick is above the head" if readback.pending or waits else ""


def chosen_elsewhere(name: str) -> str:
    """Message for a press on something that another browser has changed: browsers share what they show."""
    return f"{name} was chosen in another browser: choose here what you want, and press again"


def _arm(rig: str) -> str:
    return f"“{command('arm', rig)}” (systemd services: “sudo drumstick-at {rig} arm”)"


def notice_of(
    connected: bool, state: State | None, silence_s: float | None, rig: str, due: str = ""
) -> Notice:
    """The rig's condition. `silence_s` is None when the haptic server was never heard, 0 while it is heard. `due` names
    the scene that somebody wants and that is made ready: then a short silence is no alarm.
    """
    if state is None or silence_s is None:
        where = "The router answers." if connected else "No router answers yet."
        return Notice(
            "Waiting for the haptic server",
            f"{where} Start the rig with “{command('up', rig)}”; this page goes on by itself.",
            "wait",
        )
    if due and 0.0 < silence_s < _CHANGING_S:
        return Notice(
            f"Changing to {due}; no data for {silence_s:.0f} s",
            "To stop the force, use the switch at the device: the stick may still be playing. A PANIC pressed "
            "now is repeated until it is confirmed.",
            "wait",
        )
    if silence_s > 0.0:
        return Notice(
            f"No data from the haptic server for {silence_s:.0f} s",
            "To stop the force, use the switch at the device. The force loop needs no network and may still be "
            "playing; what you see below is old. Check the cable and the haptic machine.",
            "bad",
        )
    if state.status == "ready":
        return Notice("Ready", "Lift the stick and let it fall on the head.", "good")
    if state.status == "playing":
        return Notice(
            "Playing", "Tune while it plays; what the stick feels waits until it is above the head.", "busy"
        )
    if state.status == "panic":
        return Notice(
            "Panic: zero force",
            f"It stays so until somebody at the haptic machine, hands clear, types {_arm(rig)}.",
            "bad",
        )
    kind, _, why = state.status.partition(":")
    if kind == "fault":
        return Notice(
            f"Fault: {why.strip() or 'no reason given'}",
            f"The force is off. Remove the cause, then type {_arm(rig)} on the haptic machine.",
            "bad",
        )
    advice = f"This page does not know this state; ask “{command('doctor', rig)}”."
    return Notice(state.status.capitalize(), advice, "wait")


def sound_words(meters: list[Meter]) -> str:
    """The sound servers in one line."""
    if not meters:
        return "no sound server heard"
    return "; ".join(
        f"{meter.sink}: {meter.played} played, {meter.late} late, {meter.xruns} xruns, "
        f"load {100.0 * meter.load:.0f} %, latency {meter.latency_ms:.1f} ms"
        + (f", {meter.waiting}" if meter.waiting else "")
        for meter in meters
    )


def output_words(meters: Sequence[Meter]) -> str:
    """Level and peak of what the sound servers send to their devices, in dB of full scale."""
    return "; ".join(
        (f"{meter.sink}: " if len(meters) > 1 else "")
        + f"level {decibels(meter.output_rms)}, peak {decibels(meter.output_peak)}"
        for meter in meters
    )


def limited_words(meters: Sequence[Meter], limited_lately: bool) -> str:
    """Sentence on whether the output was too loud; limited_lately: for some seconds past."""
    frames = sum(meter.limited_frames for meter in meters)
    if not frames:
        return "limited: no" if meters else ""
    clipped = sum(meter.clipped_frames for meter in meters)
    count = f"{frames} frames since its start" + (f", {clipped} of them clipped" if clipped else "")
    return f"limited: turn the output down ({count})" if limited_lately else f"limited: not now ({count})"


@dataclass(frozen=True)
class Forecast:
    """A prediction in words: `about` names the values that the servo does not use (yet), `verdict` says what becomes of
    the roll, `numbers` are label, value and unit."""

    about: str
    numbers: tuple[tuple[str, str, str], ...]
    verdict: str
    refusal: str


_NO_ROLL = ("captured", "left")
_ENDS = {
    "captured": "no roll: the stick comes to rest in the head",
    "left": "no roll: the stick leaves, or its speed grows without end",
    "unsettled": "no steady roll: the strokes do not repeat",
    "endless": "no steady roll: the scene's noise or chaos never repeats",
    "": "no roll can be computed for these values",
}


def prediction_words(
    predicted: PredictedRoll, other: dict[str, float], table: dict[str, Parameter]
) -> Forecast:
    """Words for what the exact motion will do; `other`: the values that differ from the readbacks."""
    shown = [
        f"{table[n].quantity.symbol or n} {measured(v, table[n].quantity.unit)}" for n, v in other.items()
    ]
    about = f"Predicted with {', '.join(shown)}" if shown else "Predicted"
    rate, speed, multiplier = predicted.rate_Hz, predicted.v_lc_m_per_s, predicted.multiplier
    if rate is None or speed is None or multiplier is None:
        return Forecast(about, (), _ENDS[predicted.end], predicted.refusal)
    numbers = (("roll", steady(rate, 1), "Hz"), ("v_lc", steady(speed, 2), "m/s"))
    return Forecast(about, numbers, _stability(multiplier, predicted.period), predicted.refusal)


def is_no_roll(predicted: PredictedRoll) -> bool:
    """True where the motion comes to an end: strokes that are heard then are no roll, and their rate is none."""
    return predicted.end in _NO_ROLL


def _stability(multiplier: float, period: int) -> str:
    if abs(multiplier) >= 1.0:
        return "unstable: a small departure grows"
    strokes = (
        1 if multiplier == 0.0 else max(1, math.ceil(math.log(0.1) / math.log(abs(multiplier)))) * period
    )
    kinds = "" if period == 1 else f"{period} strokes by turns, "
    return f"{kinds}stable, recovers in {strokes} stroke{'s' if strokes > 1 else ''}"
