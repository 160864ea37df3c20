"""The strike pad on the page: the drum without the stick, by mouse, finger, pen and keyboard. Pure.

Like the stick's pad it is a piece of HTML with its own script, here in the attribute of a style, since its keys work
before anybody has touched it; it speaks to the panel over its own websocket (strike_access).
"""

from functools import cache
from html import escape
from importlib import resources

LABEL = (
    "Strike pad, the head from above: touch it where you want to strike. A pen strikes as hard as it presses, a mouse "
    "or finger as fast as it comes. Shift strikes hardest, Alt softly. The digits 1 to 9 and 0 strike from soft to "
    "hardest, anywhere on the page, and space or Enter here; arrows move the place. C stops what rings."
)
_WORDS = (
    "Strike the drum here, or with the keys 1 (soft) to 9 and 0 (hardest). The faster you come, the louder. "
    "Shift: hardest. Alt: soft. C stops what rings."
)


@cache
def _script() -> str:
    return (resources.files("web_panel.page") / "strike_pad.js").read_text(encoding="utf-8")


@cache
def strike_pad() -> str:
    """The pad's HTML."""
    return (
        f'<div class="dr dr-play"><div class="dr-head" data-part="strike-pad" role="application" tabindex="0" '
        f'aria-label="{escape(LABEL)}"><style onload="{escape(_script())}">.dr-head{{}}</style><b></b>'
        f"</div><span data-words>{escape(_WORDS)}</span></div>"
    )
