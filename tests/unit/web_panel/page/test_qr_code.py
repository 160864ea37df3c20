"""The code in both forms has the very modules that the library computes; whether a camera reads them is its affair."""

import re

import segno

from web_panel.page import qr_code

LINK = "https://192.168.100.100:8443/?login=AAAAAAAAAAAAAAAAAAAAAA"


def modules() -> list[list[int]]:
    return [list(row) for row in segno.make_qr(LINK, error="m").matrix_iter(border=4)]


def test_half_blocks_hold_two_rows_each_and_its_own_colours() -> None:
    lines = qr_code.terminal_lines(LINK)
    assert all(line.startswith("\x1b[30;107m") and line.endswith("\x1b[0m") for line in lines)
    rows: list[list[int]] = []
    for line in lines:
        blocks = line.removeprefix("\x1b[30;107m").removesuffix("\x1b[0m")
        rows += [[int(b in "▀█") for b in blocks], [int(b in "▄█") for b in blocks]]
    wanted = modules()
    assert rows[: len(wanted)] == wanted
    assert not any(any(row) for row in rows[len(wanted) :])
    assert len(lines[0]) < 80


def test_the_picture_has_a_name_and_the_same_modules() -> None:
    svg = qr_code.picture(LINK, 'a "name"')
    assert 'role="img" aria-label="a &quot;name&quot;"' in svg
    dark = {(int(x), int(y)) for x, y in re.findall(r"M(\d+) (\d+)h1v1h-1z", svg)}
    assert dark == {(x, y) for y, row in enumerate(modules()) for x, bit in enumerate(row) if bit}
