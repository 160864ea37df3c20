"""Lines on stderr: plain for people, with their level where the journal reads them."""

import logging
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from realtime.log import is_journal, marked
from unread import full_pipe

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


SERVICES = Path(__file__).resolve().parents[3] / "services"
MAINS = (
    "haptic_server/servo/process.py",
    "haptic_server/gateway/process.py",
    "haptic_server/access/process.py",
    "sound_server/process.py",
    "web_panel/process.py",
    "rig/recording/__main__.py",
)


def test_every_service_has_this_log() -> None:
    found = [path for path in SERVICES.rglob("*.py") if "logging.basicConfig(" in path.read_text()]
    assert not found
    assert not [main for main in MAINS if "open_log(" not in (SERVICES / main).read_text()]
    ends = [(SERVICES / main).with_name("__main__.py").read_text() for main in MAINS]
    assert all("end_process(main())" in text for text in ends)


def test_a_service_ends_with_its_log_written_and_takes_nothing_apart() -> None:
    code = """
import logging, time
from realtime.log import end_process, open_log
open_log()
class Kernel:
    def __del__(self):
        time.sleep(60.0)
kernel = Kernel()
kernel.itself = kernel
logging.warning("the last line")
end_process(3)
"""
    ended = subprocess.run(
        [sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, check=False, timeout=30.0
    )
    assert (ended.returncode, ended.stderr) == (3, "the last line\n")


def test_no_service_prints() -> None:
    prints = re.compile(r"(?<!\w)print\(|import .*\bsay\b|sys\.std(out|err)\.write")
    # These two answer whoever starts them as a process, on standard output.
    answer = {SERVICES / "haptic_server/servo/selftest.py", SERVICES / "sound_server/sinks/reconnecting.py"}
    parts = [SERVICES / part for part in ("haptic_server", "sound_server", "web_panel", "rig/recording")]
    found = {path for part in parts for path in part.rglob("*.py") if prints.search(path.read_text())}
    # `drumstick record`: the command, and what it says of the recording.
    assert found - answer == {SERVICES / "rig/recording/record.py", SERVICES / "rig/recording/recorder.py"}


@pytest.mark.parametrize("ends_by_itself", [True, False])
def test_a_log_that_nobody_reads_holds_up_neither_the_process_nor_its_end(ends_by_itself: bool) -> None:
    code = """
import logging, sys
from realtime.log import flush_log, open_log
open_log()
for number in range(5000):
    logging.warning("late by %d", number)
print("still here", flush=True)
sys.exit(3)
"""
    with full_pipe() as (reading, writing):
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=writing)
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == b"still here\n"
            if not ends_by_itself:
                os.close(reading)  # its end need not wait for anybody then
            assert process.wait(60.0) == 3
        finally:
            process.kill()
            process.wait()
            assert process.stdout is not None
            process.stdout.close()


def test_exceptions_that_nobody_caught_are_in_the_log_in_their_order() -> None:
    code = """
import logging, threading
from realtime.log import open_log
open_log(names_level=True)
class Bad:
    def __del__(self):
        raise ValueError("in del")
def run():
    raise ValueError("in thread")
logging.info("begin")
logging.info("%d", "no number")
Bad()
thread = threading.Thread(target=run, name="osc")
thread.start()
thread.join()
logging.info("end")
raise ValueError("in main")
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "JOURNAL_STREAM": ""},
    )
    assert done.returncode == 1
    heads = [line for line in done.stderr.splitlines() if not line.startswith(("  ", "Traceback"))]
    assert heads[0] == "begin"
    assert "logs what cannot be put in words" in heads[1]
    assert heads[2].startswith("TypeError: ")
    assert heads[3].startswith("ERROR: ")
    assert heads[4:] == [
        "ValueError: in del",
        "CRITICAL: a fault that ends the thread osc: ValueError",
        "ValueError: in thread",
        "end",
        "CRITICAL: a fault that ends this process: ValueError",
        "ValueError: in main",
    ]


@pytest.mark.parametrize("where", ["2>/dev/full", "2>&-", "1>&- 2>&-"])
def test_a_command_whose_words_are_lost_keeps_its_exit_status(where: str) -> None:
    command = f"exec '{sys.executable}' -c 'from rig.cli.command import main; main()' scene show nope {where}"
    done = subprocess.run(["sh", "-c", command], stdout=subprocess.PIPE)
    assert (done.returncode, done.stdout) == (2, b"")
