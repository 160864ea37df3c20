"""Navigation of the site, read from the pages themselves, so that the forge shows the same lists.

A door is index.md, or a page that index.md lists. Of a door, each line `- [Title](page.md): words` puts that page here,
under the `##` heading above it. A folder's README.md has the folder's other pages. Sphinx warns of a page that stands
nowhere, and so no site is made.
"""

import re
from functools import cache
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

_LISTED = re.compile(
    r"^(?:## (?P<heading>.+)|- \[(?P<title>[^]]+)\]\((?P<page>[\w./-]+)\.md\).*)$", re.MULTILINE
)


def _toctree(caption: str, entries: list[str]) -> str:
    options = [":hidden:", *([f":caption: {caption}"] if caption else [])]
    return "\n".join(["", "```{toctree}", *options, *entries, "```", ""])


def _listed(text: str) -> dict[str, list[str]]:
    """Heading -> entries of a toctree."""
    found: dict[str, list[str]] = {"": []}
    for line in _LISTED.finditer(text):
        if heading := line["heading"]:
            found[heading] = []
        else:
            found[list(found)[-1]].append(f"{line['title']} <{line['page']}>")
    return found


@cache
def _doors(docs: Path) -> set[str]:
    index = (docs / "index.md").read_text(encoding="utf-8")
    return {"index", *(line["page"] for line in _LISTED.finditer(index) if line["page"])}


def _add_toctrees(app: Sphinx, page: str, source: list[str]) -> None:
    docs = Path(app.srcdir)
    if page in _doors(docs):
        source[0] += "".join(_toctree(*part) for part in _listed(source[0]).items() if part[1])
    elif page.endswith("/README"):
        others = sorted(path.stem for path in (docs / page).parent.glob("*.md") if path.stem != "README")
        source[0] += _toctree("", others)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("source-read", _add_toctrees)
    return {"parallel_read_safe": True}
