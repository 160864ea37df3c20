"""The page's own script, for what viser's client leaves out: names for keyboards and screen readers. Pure."""

from functools import cache
from importlib import resources


@cache
def page_script() -> str:
    """JavaScript, for an event attribute of a piece that is there once."""
    return (resources.files("web_panel.page") / "page.js").read_text(encoding="utf-8")
