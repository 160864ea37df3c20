"""Measurements of real drums by others: tests/physics/drumstick/reference/drums.toml."""

import tomllib
from pathlib import Path
from typing import Any

_FILE = Path(__file__).parent / "physics/drumstick/reference/drums.toml"
DRUMS: dict[str, dict[str, Any]] = tomllib.loads(_FILE.read_text(encoding="utf-8"))
