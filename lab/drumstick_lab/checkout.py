"""Folders of the checkout in which the laboratory's programs work."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS, TESTS = ROOT / "docs", ROOT / "tests"
# Another folder for a run that shall not touch what is stored: drumstick lab measure --out DIR.
OTHER_RESULTS = "DRUMSTICK_LAB_RESULTS"
RESULTS = Path(os.environ.get(OTHER_RESULTS) or ROOT / "lab" / "results")


def share_tests() -> None:
    """Let programs import the tests' witnesses and rigs, by the names that tests use for them."""
    for folder in (TESTS / "system", TESTS):
        if str(folder) not in sys.path:
            sys.path.insert(0, str(folder))
