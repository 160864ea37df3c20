"""The stored results of benchmarks, and where they come from: for the pages that are made of them."""

import json
from typing import Any

from drumstick_lab.checkout import RESULTS


def read(name: str) -> dict[str, Any]:
    """Result that a program of the laboratory stored."""
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def where(result: dict[str, Any]) -> str:
    """Date and machine of a result, as one sentence."""
    machine = result["machine"]
    return f"{machine['date']}, {machine['processor']}, {machine['cores']} cores, Python {machine['python']}."
