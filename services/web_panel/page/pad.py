"""The pad on the page, for rigs whose stick follows a pointer: press and drag, or the space bar. Pure.

viser offers no such control. So the pad is a piece of HTML with its own script in an event attribute, which a browser
runs although the piece is put into the page as text; it speaks to the panel over its own websocket (pointer_access).
"""

from functools import cache
from html import escape
from importlib import resources

LABEL = (
    "Drumstick pad: press and drag down to strike, hold it down for a roll, let go to lift. "
    "Space or Enter strikes and holds; left and right arrows move over the head."
)


@cache
def _script() -> str:
    return (resources.files("web_panel.page") / "pad.js").read_text(encoding="utf-8")


@cache
def pad() -> str:
    """The pad's HTML."""
    # Set up by whatever comes first: a pointer over it, or the focus of a keyboard.
    return (
        f'<div class="dr"><div class="dr-pad" data-part="pad" role="application" tabindex="0" '
        f'aria-label="{escape(LABEL)}" onpointerenter="{escape(_script())}" onfocus="this.onpointerenter(event)">'
        "<b></b><span>lifted</span>"
        "<span data-words>Press and drag down to strike; hold it down for a roll. Or: space</span>"
        "<span>pressed into the head</span></div></div>"
    )
