"""Folders of the checkout in which the laboratory's programs work."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS, TESTS, RESULTS = ROOT / "docs", ROOT / "tests", ROOT / "lab" / "results"


def share_tests() -> None:
    """Let programs import the tests' witnesses and rigs, by the names that tests use for them."""
    for folder in (TESTS / "system", TESTS):
        if str(folder) not in sys.path:
            sys.path.insert(0, str(folder))
