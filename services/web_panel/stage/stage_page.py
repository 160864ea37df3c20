"""The stage page: one file with its own script and style, and a policy that admits nothing else."""

import base64
import hashlib
from html import escape
from importlib import resources

from web_panel.access.viser_access import OwnPage
from web_panel.stage.stage_socket import PATH as STATE_PATH

PATH = "/stage"
CUT_OFF = "No connection to the panel"
NO_WEBGL = "This browser shows no 3-D picture (WebGL)"
_HTML = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Drumstick: {rig}</title>
<link rel="icon" href="data:,"><style>{style}</style>
<main><canvas role="img" aria-label="Stick and drum as the player sees them"></canvas>
<p id="rig">{rig}</p><p id="words" role="status"></p></main>
<script data-state="{state}" data-cut-off="{cut_off}" data-no-webgl="{no_webgl}">{script}</script></html>"""


def _text(name: str) -> str:
    return (resources.files("web_panel.stage") / name).read_text(encoding="utf-8")


def _hash_of(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def stage_page(rig: str) -> OwnPage:
    """The page of this rig."""
    style, script = _text("stage.css"), _text("stage.js")
    html = _HTML.format(
        rig=escape(rig),
        style=style,
        script=script,
        state=STATE_PATH,
        cut_off=CUT_OFF,
        no_webgl=NO_WEBGL,
    )
    return OwnPage(
        html.encode(),
        f"default-src 'none'; script-src {_hash_of(script)}; style-src {_hash_of(style)}; img-src data:; "
        "connect-src {websocket}",
    )
