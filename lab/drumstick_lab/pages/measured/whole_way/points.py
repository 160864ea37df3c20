"""The figure of the whole way as SVG: each of its points says what it is when pointed at, or reached by Tab.

Drawn by the program that draws the PNG, with an invisible box of words for each point, which CSS shows: no JavaScript, and
nothing is loaded. The documentation site puts it where the page names the PNG (docs/site/links.py).
"""

import io
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from drumstick_lab.accuracy import figures
from drumstick_lab.accuracy.choices import named, never
from rig.figures.style import INK, styled

Row = dict[str, Any]
_SVG, _HREF = "http://www.w3.org/2000/svg", "{http://www.w3.org/1999/xlink}href"
_MADE_FROM = "data-made-from"
_LINE, _LINES, _MARGIN = 12.0, 5, 8.0  # points
_HINT = "Point at a mark, or move from mark to mark with Tab: here it says what it is, how far off, and what it costs."
_STYLE = f"""
.choices {{ display: block; width: 100%; min-width: 40rem; max-width: 60rem; height: auto; }}
.choices text.said {{ font: 8.5px "DejaVu Sans", Verdana, sans-serif; fill: {INK}; }}
.choice {{ outline: none; cursor: pointer; }}
.choice .ring {{ fill: transparent; }}
.choice .words {{ visibility: hidden; pointer-events: none; }}
.choice:hover .words, .choice:focus .words {{ visibility: visible; }}
.choices:has(.choice:hover) .choice:not(:hover) .words {{ visibility: hidden; }}
.choice:hover .ring, .choice:focus .ring {{ stroke: {INK}; stroke-width: 1.5; }}
"""


def _cost(row: Row) -> str:
    memory = "none" if row["memory_bytes"] is None else f"{1e-3 * row['memory_bytes']:.2g} kB"
    kind = "on the wire, a strike" if row["stage"] == "message" else "memory of its own"
    latency = "none" if row["latency_ms"] is None else f"{row['latency_ms']:.2g} ms"
    return f"Costs: {100.0 * row['share_of_core']:.2g} % of a core; {kind}: {memory}; latency of its own: {latency}"


def _verdict(row: Row, refused: list[tuple[Row, Row]]) -> str:
    for worse, better in refused:
        if worse is row:
            return f"Nobody should choose it: {named(better)} is as true or truer, and costs no more"
    if row.get("refused"):
        return "No choice: the servo refuses it"
    if "guesses" in row:
        return "A choice: a message guesses at the hand that presses, a stream knows what it did"
    return "A choice: nothing of its stage is as true and costs clearly less"


def words(found: Row) -> list[list[str]]:
    """Lines that each drawn point of the whole way says, in the order of `figures.points`."""
    refused = never(found["rows"])
    return [
        [
            f"{row['stage']}: {named(row)}",
            f"Error: {row['jnds']:.2g} JND at worst, of its {row['binds']}",
            "; ".join(f"{each['what']} {each['value']:.2g} {each['unit']}" for each in row["measures"]),
            _cost(row),
            _verdict(row, refused),
        ]
        for row in figures.points(found)
    ]


@styled
def _drawn(found: Row) -> ET.Element:
    out = io.StringIO()
    none = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figures.whole(found).savefig(out, format="svg", metadata=none)  # pyright: ignore[reportArgumentType]
    return ET.fromstring(out.getvalue())


def _add(parent: ET.Element, tag: str, text: str = "", **given: str | float) -> ET.Element:
    names = {name.replace("_", "-").rstrip("-"): str(value) for name, value in given.items()}
    added = ET.SubElement(parent, f"{{{_SVG}}}{tag}", names)
    added.text = text
    return added


def _box(parent: ET.Element, lines: list[str], top: float, width: float) -> None:
    _add(parent, "rect", x=0, y=top, width=width, height=_LINES * _LINE + 2 * _MARGIN, fill="white")
    for at, line in enumerate(lines):
        _add(parent, "text", line, class_="said", x=_MARGIN, y=top + _MARGIN + (at + 0.8) * _LINE)


def svg(found: Row, digest: str) -> str:
    """The figure of a result's part `whole`, as an element for a page. The same result gives the same text."""
    root = _drawn(found)
    width, height = (float(each) for each in root.attrib["viewBox"].split()[2:])
    for style in root.findall(f"{{{_SVG}}}defs"):  # its rules would hold for the page around it
        root.remove(style)
    root.attrib = {
        "viewBox": f"0 0 {width:g} {height + _LINES * _LINE + 2 * _MARGIN:g}",
        "class": "choices",
        "role": "group",
        "aria-label": "Largest error of each choice over its share of a core: a mark for each",
        "stroke-linejoin": "round",
        _MADE_FROM: digest,
    }
    _add(root, "style", _STYLE)
    _box(root, [_HINT], height, width)
    parents = {child: parent for parent in root.iter() for child in parent}
    groups = {each.get("id"): each for each in root.iter()}
    for row, lines in zip(figures.points(found), words(found), strict=True):
        mark = groups[figures.point_id(found, row)]
        parents[mark].remove(mark)
        at = next(each for each in mark.iter() if each.tag == f"{{{_SVG}}}use")
        assert _HREF in at.attrib
        point = _add(root, "g", class_="choice", tabindex="0", role="img")
        _add(point, "title", ". ".join(lines))
        point.append(mark)
        _add(point, "circle", class_="ring", cx=at.attrib["x"], cy=at.attrib["y"], r=7)
        _box(_add(point, "g", class_="words", aria_hidden="true"), lines, height, width)
    ET.register_namespace("", _SVG)
    ET.register_namespace("xlink", _HREF[1:].partition("}")[0])
    return ET.tostring(root, encoding="unicode") + "\n"


def digest_of(path: Path) -> str | None:
    """Digest that an SVG of `svg` carries; None where there is none."""
    return ET.parse(path).getroot().get(_MADE_FROM) if path.exists() else None
