"""Pictures of the docs as files: few colours, and a digest of what each was made from, so that a test can tell a stale one without drawing it."""

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from rig.figures.style import drawn_png

COLOURS = 240  # a palette halves the files; the eye sees no difference
_MADE_FROM = "Made from"


def digest_of(path: Path) -> str | None:
    """Digest that a picture carries; None where there is none."""
    if not path.exists():
        return None
    with Image.open(path) as picture:
        return picture.info.get(_MADE_FROM)


def store(figure: Figure, path: Path, digest: str) -> None:
    """Write a figure as PNG. OSError when it cannot be written."""
    info = PngInfo()
    info.add_text(_MADE_FROM, digest)
    with Image.open(io.BytesIO(drawn_png(figure))) as drawn:
        store_image(drawn, path, info)


def store_image(image: Image.Image, path: Path, info: PngInfo | None = None) -> None:
    """Write a picture as PNG. OSError when it cannot be written."""
    few = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True, pnginfo=info)
