"""Pictures of the page in its states, one folder for each size of the window, and a contact sheet of each folder."""

import base64
import re
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import CDPSession, Page

from drumstick_lab.pages import stored_picture

_SHEET_PX = 3000  # of its width: a screen shows it whole, and at its own size the page's words can be read
_AREA_PX = 110_000.0  # of one small picture, upright or lying
_GAP_PX, _LINE_PX, _FONT_PX = 6, 16, 13.0
_GROUND, _INK = (255, 255, 255), (20, 20, 20)
_TOP = ".dr-panic"
_SCROLL = "part => part.scrollIntoView({block: 'start'})"
_OPENED_MS = 400.0  # a folder unfolds
_SETTLED_MS = 600.0  # the page's own script looks every 500 ms for plots that got another width


class StatePictures:
    """Takes pictures into a folder, and makes sheets of those that it took."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._taken: dict[str, list[tuple[str, Path]]] = {}

    def take(
        self, page: Page, chrome: CDPSession, size: tuple[int, int], words: str, seen_at: tuple[str, ...]
    ) -> None:
        """Keep what the window, of this size, shows in the state of these words. `seen_at`: selectors of folders, which
        are opened, and of the part, the last one, that the page scrolls to; none: to the top. Raises OSError.
        """
        page.wait_for_timeout(_SETTLED_MS)
        for selector in seen_at or (_TOP,):
            found = page.locator(selector).first
            if (
                found.get_attribute("aria-expanded") == "false"
            ):  # between a phone's size and others all folders close
                found.click()
                page.wait_for_timeout(_OPENED_MS)
            found.evaluate(_SCROLL)
        shot = chrome.send("Page.captureScreenshot", {"format": "png"})
        name = f"{size[0]}x{size[1]}"
        taken = self._taken.setdefault(name, [])
        file = f"{len(taken):02d}-{re.sub(r'[^a-z0-9]+', '-', words.lower())}.png"
        path = self._folder / name / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(shot["data"]))
        taken.append((words, path))

    def sheets(self) -> list[Path]:
        """Write panel-states-SIZE.png for each size into the folder; the files. Raises OSError."""
        made: list[Path] = []
        for name, taken in self._taken.items():
            made.append(self._folder / f"panel-states-{name}.png")
            stored_picture.store_image(contact_sheet(taken), made[-1])
        return made


def contact_sheet(pictures: Sequence[tuple[str, Path]]) -> Image.Image:
    """Small pictures in rows, each with its words below it. All have the size of the first; ValueError when there is none."""
    if not pictures:
        raise ValueError("a contact sheet needs a picture")
    width, height = _small(pictures[0][1])
    font = ImageFont.load_default(_FONT_PX)
    below = [_lines(words, font, width) for words, _ in pictures]
    row = height + _LINE_PX * max(len(lines) for lines in below) + _GAP_PX
    columns = min((_SHEET_PX - _GAP_PX) // (width + _GAP_PX), len(pictures))
    rows = -(-len(pictures) // columns)
    made = Image.new("RGB", (_GAP_PX + columns * (width + _GAP_PX), _GAP_PX + rows * row), _GROUND)
    draw = ImageDraw.Draw(made)
    for number, ((_, path), lines) in enumerate(zip(pictures, below, strict=True)):
        down, across = divmod(number, columns)
        left, top = _GAP_PX + across * (width + _GAP_PX), _GAP_PX + down * row
        with Image.open(path) as picture:
            small = picture.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)
        made.paste(small, (left, top))
        draw.multiline_text((left, top + height), "\n".join(lines), _INK, font, spacing=_LINE_PX - _FONT_PX)
    return made


def _small(path: Path) -> tuple[int, int]:
    with Image.open(path) as picture:
        scale = (_AREA_PX / (picture.width * picture.height)) ** 0.5
        return round(scale * picture.width), round(scale * picture.height)


def _lines(words: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> list[str]:
    # Lines of whole words, as many as there is width for.
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if font.getlength(longer) <= width or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
