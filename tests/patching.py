"""Running a patching program without a screen, and reading what it prints."""

import os
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PD = ["pd", "-nogui", "-nosound", "-nomidi", "-noprefs", "-stderr"]


def headless(folder: Path) -> dict[str, str]:
    """An environment in which Pd and sclang run without a screen, with files of their own in `folder`."""
    run = folder / "run"
    run.mkdir(mode=0o700, exist_ok=True)
    return dict(
        os.environ,
        HOME=str(folder),
        XDG_RUNTIME_DIR=str(run),
        QT_QPA_PLATFORM="offscreen",
        QTWEBENGINE_DISABLE_SANDBOX="1",
    )


@contextmanager
def listening(command: list[str], environment: dict[str, str]) -> Iterator[list[str]]:
    """The program, and the lines that it prints as they come."""
    lines: list[str] = []
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )
    assert process.stdout is not None
    reader = threading.Thread(target=lambda: lines.extend(iter(process.stdout.readline, "")), daemon=True)
    reader.start()
    try:
        yield lines
    finally:
        process.kill()
        process.wait()
        reader.join(5.0)
        assert process.stdin is not None
        process.stdin.close()
        process.stdout.close()
