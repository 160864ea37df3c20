"""A program of a few kernels, run in a process of its own with a store of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]


def answer_of(program: str, folder: Path, word: str = "") -> Any:
    """JSON that the program prints with `word` as its argument; it may print nothing else, not even a warning.

    Runs with the same `folder` share a store.
    """
    file = folder / "program.py"
    file.write_text(program, encoding="utf-8")
    path = os.pathsep.join(str(ROOT / part) for part in ("shared", "services"))
    environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"), PYTHONPATH=path)
    done = subprocess.run(
        [sys.executable, file, word],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)
