"""Lines on stderr: plain for people, with their level where the journal reads them."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from realtime.log import is_journal, marked

SAY = """
import logging
from realtime.log import open_log, say
open_log(names_level=True)
logging.info("ready")
logging.warning("late")
logging.error("lost\\nfor good")
say(logging.ERROR, "drumstick: wrong")
"""


def test_whose_stderr_it_is(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as file:
        found = os.fstat(file.fileno())
        mine = {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"}
        assert is_journal(mine, file.fileno())
        assert not is_journal({}, file.fileno())
        assert not is_journal({"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino + 1}"}, file.fileno())
    assert not is_journal(mine, 12345)


@pytest.mark.parametrize(
    ("level", "mark"),
    [(logging.DEBUG, 6), (logging.INFO, 6), (logging.WARNING, 4), (logging.ERROR, 3), (logging.CRITICAL, 3)],
)
def test_each_line_has_its_level(level: int, mark: int) -> None:
    assert marked(level, "a\nb") == f"<{mark}>a\n<{mark}>b"


@pytest.mark.parametrize("is_the_journals", [True, False])
def test_what_a_process_says(tmp_path: Path, is_the_journals: bool) -> None:
    with (tmp_path / "log").open("w") as file:
        found = os.fstat(file.fileno())
        stream = f"{found.st_dev}:{found.st_ino if is_the_journals else 0}"
        subprocess.run(
            [sys.executable, "-c", SAY], stderr=file, check=True, env={**os.environ, "JOURNAL_STREAM": stream}
        )
    said = (tmp_path / "log").read_text().splitlines()
    if is_the_journals:
        assert said == ["<6>ready", "<4>late", "<3>lost", "<3>for good", "<3>drumstick: wrong"]
    else:
        assert said == ["ready", "WARNING: late", "ERROR: lost", "for good", "drumstick: wrong"]


def test_every_service_has_this_log() -> None:
    services = Path(__file__).resolve().parents[3] / "services"
    found = [path for path in services.rglob("*.py") if "logging.basicConfig(" in path.read_text()]
    assert not found
