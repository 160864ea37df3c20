"""Writes docs/daw/files, the ready files for DAWs and patching programs: drumstick lab daw-files.

Addresses, types, ports and ranges come from the code, so none of these files is edited by hand.
"""

import json
import re
import uuid
from collections.abc import Callable
from pathlib import Path

from drumstick_lab.checkout import DOCS
from drumstick_lab.pages.daw import daw_max, daw_pd, daw_touch
from drumstick_lab.pages.daw.daw_facts import faders, words

FILES = DOCS / "daw" / "files"
TEMPLATES = Path(__file__).parent / "templates"


def _specs() -> str:
    rows = (
        f"    {f.name}: ControlSpec({f.travel.low:g}, {f.travel.high:g}, \\{'exp' if f.travel.log else 'lin'}, 0, "
        f'{f.start:g}, "{f.unit}")'
        for f in faders()
    )
    return ",\n".join(rows)


def _rows() -> str:
    found = [
        {
            "name": f.name,
            "address": f.address,
            "low": f.travel.low,
            "high": f.travel.high,
            "step": (f.travel.high - f.travel.low) / 1000,
            "unit": f.unit,
            "start": f.start,
        }
        for f in faders()
    ]
    return ",\n".join(f"    {json.dumps(row)}" for row in found)


def filled(name: str) -> str:
    """A template with its words; ValueError names what is not known."""
    known = words() | {
        "SPECS": _specs(),
        "PARAMETERS": _rows(),
        "UUID": str(uuid.uuid5(uuid.NAMESPACE_URL, "haptic drumstick for Bitwig")),
    }

    def word(match: re.Match[str]) -> str:
        if match[1] not in known:
            raise ValueError(f"{TEMPLATES / name}: <<{match[1]}>> is not one of {', '.join(sorted(known))}")
        return known[match[1]]

    return re.sub(r"<<([A-Z0-9_]+)>>", word, (TEMPLATES / name).read_text(encoding="utf-8"))


# Text by the file's name; drumstick.tosc, which is packed, stands apart: its bytes depend on the zlib at hand.
TEXTS: dict[str, Callable[[], str]] = {
    "drumstick.pd": daw_pd.file,
    "drumstick.scd": lambda: filled("drumstick.scd"),
    "drumstick.control.js": lambda: filled("drumstick.control.js"),
    "Drumstick.ReaperOSC": lambda: filled("Drumstick.ReaperOSC"),
    "drumstick.maxpat": daw_max.file,
    "drumstick-open-stage-control.json": daw_touch.session,
}
LAYOUT = FILES / "drumstick.tosc"


def stale() -> list[str]:
    """The files that are not what the code makes of them now."""
    found = [n for n, made in TEXTS.items() if (FILES / n).read_text(encoding="utf-8") != made()]
    return [*found, LAYOUT.name] if daw_touch.unpacked(LAYOUT.read_bytes()) != daw_touch.layout() else found


if __name__ == "__main__":
    FILES.mkdir(parents=True, exist_ok=True)
    for file_name, text in TEXTS.items():
        (FILES / file_name).write_text(text(), encoding="utf-8")
    LAYOUT.write_bytes(daw_touch.packed())
