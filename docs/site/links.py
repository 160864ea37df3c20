"""Links to what is no page: a file outside docs/ gets one, a sound a player; a PNG gives way to an SVG of its name."""

import os
import re
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import download_reference
from sphinx.application import Sphinx
from sphinx.builders.html import StandaloneHTMLBuilder
from sphinx.util import logging

ROOT = Path(__file__).parents[2]
# Files at the root that have a page: `made` adds their text to it.
PAGES = {
    "README.md": "index",
    "CHANGELOG.md": "changelog",
    "CONTRIBUTING.md": "contributing",
    "SECURITY.md": "reporting",
}
_LINK = re.compile(r"\]\(((?:\.\./)+[^)#\s]+)(#[^)\s]*)?\)")
_SCHEME = "source:"
_LINKED: set[str] = set()


def _mark(app: Sphinx, page: str, source: list[str]) -> None:
    """Give a link that leaves docs/ a scheme of its own, before Markdown is read."""
    folder = (Path(app.srcdir) / page).parent

    def marked(link: re.Match[str]) -> str:
        path = Path(os.path.normpath(folder / link[1]))
        if path.is_relative_to(app.srcdir):
            return link[0]
        name = path.relative_to(ROOT).as_posix()
        if name in PAGES:
            return f"]({os.path.relpath(Path(app.srcdir) / PAGES[name], folder)}.md{link[2] or ''})"
        if not path.is_file():
            logging.getLogger(__name__).warning("no file: %s", name, location=page)
        return f"]({_SCHEME}{name})"

    source[0] = _LINK.sub(marked, source[0])


def _point(app: Sphinx, doctree: nodes.document, page: str) -> None:
    """Point marked links to the file's page."""
    for link in doctree.findall(nodes.reference):
        if link.get("refuri", "").startswith(_SCHEME):
            name = link["refuri"].removeprefix(_SCHEME)
            _LINKED.add(name)
            link["refuri"] = app.builder.get_relative_uri(page, f"source/{name}")
            link["internal"] = True
    for link in list(doctree.findall(download_reference)):
        if link["reftarget"].endswith(".flac"):
            address = "../" * page.count("/") + f"_downloads/{link['filename']}"
            player = f'<audio controls preload="none" src="{escape(address)}"></audio>'
            link.parent.insert(link.parent.index(link) + 1, nodes.raw("", player, format="html"))
    for image in list(doctree.findall(nodes.image)):
        drawn = (Path(app.srcdir) / image["uri"]).with_suffix(".svg")
        if drawn.suffix != Path(image["uri"]).suffix and drawn.is_file() and len(image.parent.children) == 1:
            # In the page itself: as an image it could not be pointed at.
            inline = f'<div class="drawn">{drawn.read_text(encoding="utf-8")}</div>'
            image.parent.replace_self(nodes.raw("", inline, format="html"))


def _pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    assert isinstance(app.builder, StandaloneHTMLBuilder)
    for name in sorted(_LINKED):
        text = (ROOT / name).read_text(encoding="utf-8")
        language = {".py": "python", ".toml": "toml", ".sh": "bash"}.get(Path(name).suffix, "text")
        body = app.builder.highlighter.highlight_block(text, language, location=name)
        yield f"source/{name}", {"title": name, "body": f"<h1>{escape(name)}</h1>\n{body}"}, "page.html"


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("source-read", _mark, priority=600)  # after what `made` adds
    app.connect("doctree-resolved", _point)
    app.connect("html-collect-pages", _pages)
    return {"parallel_read_safe": True}
