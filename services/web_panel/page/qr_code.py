"""A link as a QR code: for a camera at a terminal, and as a picture in the page. Pure."""

from html import escape

import segno

_BORDER = 4  # modules of white around it, which cameras need
_DARK_ON_LIGHT, _RESET = "\x1b[30;107m", "\x1b[0m"  # whatever the terminal's own colours are
_HALVES = {(0, 0): " ", (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}


def _rows(link: str) -> list[list[int]]:
    # 1 is dark.
    code = segno.make_qr(link, error="m")
    return [list(row) for row in code.matrix_iter(border=_BORDER)]


def terminal_lines(link: str) -> list[str]:
    """Lines of half blocks, two rows of the code in each."""
    rows = _rows(link)
    if len(rows) % 2:
        rows.append([0] * len(rows[0]))
    pairs = zip(rows[::2], rows[1::2], strict=True)
    return [
        _DARK_ON_LIGHT + "".join(_HALVES[pair] for pair in zip(upper, lower, strict=True)) + _RESET
        for upper, lower in pairs
    ]


def picture(link: str, name: str) -> str:
    """SVG of the link; `name` for those who do not see it."""
    rows = _rows(link)
    dark = "".join(f"M{x} {y}h1v1h-1z" for y, row in enumerate(rows) for x, bit in enumerate(row) if bit)
    size = len(rows)
    return (
        f'<svg class="dr-qr" role="img" aria-label="{escape(name)}" viewBox="0 0 {size} {size}" '
        f'shape-rendering="crispEdges"><path fill="#fff" d="M0 0h{size}v{size}H0z"/><path d="{dark}"/></svg>'
    )
