"""Files of accuracy that the panel shows: a summary that comes with the package, and this machine's own result."""

from pathlib import Path

FILE = "accuracy.json"
SHIPPED = Path(__file__).parent / "shipped_accuracy.json"
