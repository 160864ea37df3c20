"""Old names in the text of a scene, renewed where the text is shown: who keeps it starts from today's names."""

import re
from typing import Any

from drumstick.drum.effects.registry import FORMER_NAMES
from drumstick.scenes.line_numbers import lines_of
from drumstick.scenes.reading import tables_of


def with_present_names(text: str) -> str:
    """The text of a good scene with today's names of its effects; comments and all else stay as they are."""
    effects: dict[str, Any] = tables_of(text).get("drum", {}).get("effects", {})
    lines, places = text.split("\n"), lines_of(text)
    for former, name in FORMER_NAMES.items():
        if former not in effects:
            continue
        path = f"drum.effects.{former}"
        # Dotted keys name the table on each of their lines; in braces it stands on the line of what it is in.
        named = {line for place, line in places.items() if f"{place}.".startswith(f"{path}.")}
        for line in named or {places.get("drum.effects", places["drum"])}:
            lines[line - 1] = re.sub(rf"\b{former}\b", name, lines[line - 1], count=1)
    return "\n".join(lines)
