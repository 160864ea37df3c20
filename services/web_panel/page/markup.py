"""HTML of the page's own parts. Whatever came over the network is escaped here and nowhere else. Pure."""

from html import escape

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Parameter
from protocol.messages import STICK, Readback, State, Strike
from web_panel.page.page_script import page_script
from web_panel.page.style import CSS, PHONE, TABLET, WIDE
from web_panel.page.wording import (
    Forecast,
    Notice,
    figure,
    hint_of,
    measured,
    microseconds,
    readback_note,
    spoken_unit,
    steady,
)


def style(rig: str) -> str:
    """Style sheet, script and title of the page; the browser's tab gets the rig's name."""
    # The script in an attribute: a browser runs it although the piece is put into the page as text (see pad).
    return (
        f'<style data-title="{escape(rig)}: drumstick" data-phone="{PHONE}" data-tablet="{TABLET}" '
        f'data-wide="{WIDE}" onload="{escape(page_script())}">{CSS}</style>'
        f'<h1 class="dr-unseen">Drumstick: {escape(rig)}</h1>'
    )


def heading(words: str) -> str:
    """Heading of a part of the page, for those who go from heading to heading; the eye has the folders."""
    return f'<h2 class="dr-unseen">{escape(words)}</h2>'


def beat(number: int) -> str:
    """Invisible number that changes while the panel is there; the page's script watches it."""
    return f'<div data-beat="{number}" hidden></div>'


def symbol(text: str) -> str:
    """`K_coll` with its index set low."""
    stem, _, index = text.partition("_")
    return f"{escape(stem)}<sub>{escape(index)}</sub>" if index else escape(stem)


def notice(what: Notice, panic: str = "", lease: str = "") -> str:
    """The banner at the top, of one height whatever it says. `panic`, of a press that nobody has confirmed, takes the
    place of the advice. `lease`, of who has locked the tuning, stands below where nothing is worse.
    """
    advice = (
        f'<span class="dr-alarm" data-part="panic">{escape(panic)}</span>'
        if panic
        else f"<span>{escape(what.advice)}</span>"
    )
    if lease and not panic and what.mood != "bad":
        advice += f'<span data-part="lease">{escape(lease)}</span>'
    return (
        f'<div class="dr"><div class="dr-notice dr-{what.mood}" data-part="notice">'
        f"<b>{escape(what.headline)}</b>{advice}</div></div>"
    )


def barred(name: str, closed: tuple[float, float]) -> str:
    """Style that bars these shares, from the left and from the right end, of the slider below a control's words."""
    below, above = (f"{100.0 * min(max(share, 0.0), 1.0):.1f}%" for share in closed)
    return f'<style>div:has(> [data-param="{escape(name)}"]) + div{{--below:{below};--above:{above}}}</style>'


def line(words: str, part: str, alarm: bool = False, lines: int = 0) -> str:
    """Small text. With `lines` it has the room of so many (one more on a phone) whatever it says, so that nothing below
    it moves; without, empty words take none.
    """
    kind = "dr-small dr-alarm" if alarm else "dr-small"
    text = f'<div data-part="{part}"><div class="{kind}">{escape(words)}</div></div>' if words else ""
    if lines:
        return f'<div class="dr dr-room" style="--lines:{lines}">{text}</div>'
    return f'<div class="dr">{text}</div>' if text else ""


def named(
    name: str, label: str, hint: str, value: str, unit: str = "", scale: str = "linear", old: bool = False
) -> str:
    """Name and value above a slider that is no parameter's, with what the script tells of it to screen readers. `old`
    dims the value.
    """
    return (
        f'<div class="dr-c{" dr-old" if old else ""}" data-param="{name}" data-label="{label}" '
        f'data-hint="{escape(hint)}" data-unit="{escape(spoken_unit(unit))}" '
        f'data-scale="{scale}"><div class="dr-row"><span class="dr-name">{label}</span><span class="dr-val" '
        f'data-part="readback">{escape(value)}<u>{unit}</u></span></div></div>'
    )


def _tile(part: str, label: str, value: str, unit: str, below: str = "", old: bool = False) -> str:
    return (
        f'<div class="dr-tile{" dr-old" if old else ""}" data-part="{part}"><i>{label}</i>'
        f"<b>{escape(value)}</b><u>{escape(unit)}</u>{below}</div>"
    )


def _level(level: float) -> str:
    share = 100.0 * min(max(level, 0.0), 1.0)
    bar = f'<div class="dr-level"><div style="width:{share:.0f}%"></div></div>'
    return f'<div class="dr-share">level {level:.2f}{bar}</div>'


def tiles(state: State | None, strike: Strike | None, old: bool, no_roll: bool = False) -> str:
    """The three numbers to be read from afar. `old`, of a rig that is silent, dims them. At rest, in panic and in fault
    there is no rate and no speed, and the last strike is dimmed; with `no_roll` predicted, strokes have no rate.
    """
    plays = state is not None and state.status == "playing"
    rate = steady(state.roll_rate_Hz, 1) if state and plays and not no_roll else "–"
    speed = steady(state.v_e_m_per_s, 2) if state and plays else "–"
    label = "Last strike"
    if strike and plays:
        label = f"Strike {strike.seq}" if strike.source == STICK else f"Played {strike.seq}"
    hit = steady(strike.z_speed_m_per_s, 2) if strike else "–"
    below = _level(strike.level if strike else 0.0)
    return (
        f'<div class="dr"><div class="dr-tiles{" dr-old" if old else ""}">'
        + _tile("roll-rate", "Roll rate", rate, "Hz")
        + _tile("v-e", "v<sub>E</sub> after contact", speed, "m/s")
        + _tile("strike", label, hit, "m/s", below, old=not plays)
        + "</div></div>"
    )


def health(
    scene: Scene | None, state: State | None, sound: str, output: str, limited: str, alarm: bool
) -> str:
    """Scene, timing of the servo, and the sound servers' meters: what they play, how loud it leaves, whether it is
    limited; `alarm` colours this last."""
    output = escape(f"Output: {output}") if output else ""
    limited = escape(f"Output {limited}") if limited else ""
    red = " dr-alarm" if alarm else ""
    name = (
        f'<div class="dr-small" data-part="scene">Scene: <b>{escape(scene.name)}</b></div>' if scene else ""
    )
    servo = "no data"
    if state is not None:
        dropped = f", {state.ring_dropped} records dropped" if state.ring_dropped else ""
        servo = (
            f"worst lateness <b>{microseconds(state.lateness_worst_us)}</b>, "
            f"99th percentile {microseconds(state.lateness_p99_us)}, {state.overruns} ticks missed{dropped}"
        )
    return (
        f'<div class="dr"><div class="dr-room" style="--lines:1">{name}</div>'
        f'<div class="dr-room" style="--lines:2"><div class="dr-small" data-part="servo">Servo: {servo}</div></div>'
        f'<div class="dr-room" style="--lines:2"><div class="dr-small" data-part="sound">Sound: {escape(sound)}</div>'
        "</div>"
        f'<div class="dr-room" style="--lines:1"><div class="dr-small" data-part="output">{output}</div></div>'
        f'<div class="dr-room" style="--lines:2"><div class="dr-small{red}" data-part="limited">{limited}</div></div>'
        "</div>"
    )


def chosen(*names: str) -> str:
    """Mark of which of the buttons that come next are chosen; "" for none. The page's script ticks them."""
    return f'<div data-chosen="{escape("|".join(names))}" hidden></div>'


def room(name: str) -> str:
    """Mark of the room that the browser's window is taken to have; "" when not told. The page's script watches it."""
    return f'<div class="dr-room-mark" data-room="{escape(name)}" hidden></div>'


def prediction(forecast: Forecast, old: bool = False) -> str:
    """Prediction for the value under the thumb; in red when the envelope would refuse it.

    `old` dims it: nothing plays.
    """
    numbers = "".join(
        f"<span>{symbol(label)} <b>{escape(value)}</b> {escape(unit)}</span>"
        for label, value, unit in forecast.numbers
    )
    refused = ""
    if forecast.refusal:
        refused = f'<div class="dr-alarm">The envelope would refuse this: {escape(forecast.refusal)}</div>'
    return (
        '<div class="dr dr-room" style="--lines:3">'
        f'<div class="dr-fore{" dr-out" if refused else ""}{" dr-old" if old else ""}" '
        f'data-part="prediction"><i>{escape(forecast.about)}:</i>{numbers}<u>{escape(forecast.verdict)}</u>'
        f"{refused}</div></div>"
    )


def control(
    parameter: Parameter,
    readback: Readback | None,
    reason: str,
    large: bool,
    setpoint: float | None = None,
    waits: bool = False,
) -> str:
    """Name, readback, and beside it what was asked for while that is another; below, what the parameter does, or why
    something was refused, or what is awaited.
    """
    q = parameter.quantity
    value = figure(readback.value) if readback is not None else "–"
    unit = "" if q.unit == "1" else q.unit
    kind, note = "dr-note", q.words
    if reason:
        kind, note = "dr-note dr-refused", reason
    elif waiting := readback_note(readback, waits):
        kind, note = "dr-note dr-waits", waiting
    asked = ""
    if setpoint is not None and readback is not None and setpoint != readback.value:
        asked = f'<s data-part="setpoint">→ {escape(measured(setpoint, q.unit))}</s>'
    name = q.symbol or parameter.name
    attributes = {
        "param": parameter.name,
        "label": name,
        "hint": hint_of(parameter),
        "scale": q.scale,
        "unit": spoken_unit(unit),
    }
    data = " ".join(f'data-{key}="{escape(words)}"' for key, words in attributes.items())
    return (
        f'<div class="dr-c {"dr-big" if large else "dr-more"}" {data}>'
        f'<div class="dr-row"><div class="dr-name">{symbol(name)}</div>{asked}'
        f'<div class="dr-val" data-part="readback">{escape(value)}<u>{escape(unit)}</u></div></div>'
        f'<div class="{kind}" data-part="note">{escape(note)}</div></div>'
    )
