"""Picture of the rolls that can be asked for: rate to the right, level upwards; filled where they can, a dot where the
roll is now. Pure.
"""

import math
from html import escape

import numpy as np

from web_panel.computing.computing_messages import Reach
from web_panel.computing.reach import FASTEST_HZ, SLOWEST_HZ

_WIDTH, _HEIGHT, _LEFT, _BELOW = 300.0, 110.0, 26.0, 20.0
_ROWS = 200  # levels that are looked at
_NEARLY = 1.005  # a roll at the edge is within it
_RATES, _LEVELS = (2, 5, 10, 20, 50, 100), (0.0, 0.5, 1.0)


def rate_share(rate_Hz: float) -> float:
    """Place of a rate along the picture and along its slider, 0 .. 1."""
    rate_Hz = min(max(rate_Hz, SLOWEST_HZ), FASTEST_HZ)
    return math.log(rate_Hz / SLOWEST_HZ) / math.log(FASTEST_HZ / SLOWEST_HZ)


def _x(rate_Hz: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - 8.0) * rate_share(rate_Hz)


def _y(level: float) -> float:
    return 8.0 + (_HEIGHT - _BELOW - 8.0) * (1.0 - level)


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(words)}</text>'


def closed_rates(reach: Reach, level: float) -> tuple[float, float]:
    """Shares of the rate's slider, from its left and from its right end, that this level cannot be played at."""
    slowest, fastest = (
        float(np.interp(level, reach.levels, ends)) for ends in (reach.slowest_Hz, reach.fastest_Hz)
    )
    return rate_share(slowest), 1.0 - rate_share(fastest)


def closed_levels(reach: Reach, rate_Hz: float) -> tuple[float, float]:
    """Shares of the level's slider, from its left and from its right end, that this rate cannot be played at."""
    levels = np.linspace(reach.levels[0], reach.levels[-1], _ROWS)
    slowest, fastest = (
        np.interp(levels, reach.levels, ends) for ends in (reach.slowest_Hz, reach.fastest_Hz)
    )
    inside = levels[(slowest <= _NEARLY * rate_Hz) & (rate_Hz <= _NEARLY * fastest)]
    if not len(inside):
        return 0.0, 0.0
    softest = 0.0 if inside[0] == levels[0] else float(inside[0])  # nobody has looked for softer ones
    return softest, 1.0 - float(inside[-1])


def reach_picture(reach: Reach | None, rate_Hz: float, level: float, plays: bool = True) -> str:
    """SVG with the words of its content, of one size whatever it shows. The roll that there is: 0, 0 for none.

    Unless the stick plays, that roll is what the values would lead to, and is dimmed.
    """
    marks = [_text(_x(rate), _HEIGHT - 5.0, f"{rate}", "middle") for rate in _RATES]
    marks += [_text(_LEFT - 5.0, _y(each) + 3.0, f"{each:g}", "end") for each in _LEVELS]
    lines = [f'<path d="M{_x(rate):.1f} {_y(0.0):.1f}V{_y(1.0):.1f}"/>' for rate in _RATES]
    lines += [f'<path d="M{_x(SLOWEST_HZ):.1f} {_y(each):.1f}H{_x(FASTEST_HZ):.1f}"/>' for each in _LEVELS]
    dot = f'<circle cx="{_x(rate_Hz):.1f}" cy="{_y(level):.1f}" r="5"/>' if rate_Hz > 0.0 else ""
    area, alarm = "", ""
    if reach is None:
        words = below = "What is within reach is being computed."
    elif reach.why:
        words = below = f"No roll to start from: {reach.why}"
        alarm = " dr-alarm"
    else:
        corners = [*zip(reach.slowest_Hz, reach.levels, strict=True)]
        corners += [*zip(reach.fastest_Hz, reach.levels, strict=True)][::-1]
        points = " ".join(f"{_x(rate):.1f},{_y(high):.1f}" for rate, high in corners)
        area = f'<polygon points="{points}"/>'
        now = "no steady roll now"
        if rate_Hz > 0.0:
            now = f"{'now' if plays else 'when it plays'} {rate_Hz:.1f} Hz at level {level:.2f}"
        words = (
            f"Rolls within reach: {min(reach.slowest_Hz):.0f} to {max(reach.fastest_Hz):.0f} Hz, "
            f"level up to {max(reach.levels):.2f}; {now}"
        )
        below = f"Across: rate, Hz. Up: level. Filled: within reach; {now}."
    return (
        f'<div class="dr{"" if plays else " dr-old"}" data-part="reach">'
        f'<svg class="dr-reach" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" '
        f'aria-label="{escape(words)}">{"".join(lines)}{area}{dot}{"".join(marks)}</svg>'
        f'<div class="dr-room" style="--lines:1"><div class="dr-small{alarm}">{escape(below)}</div></div></div>'
    )
