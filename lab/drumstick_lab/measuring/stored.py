"""The one way into lab/results and out of it. A result carries its machine, its version and the load beside it."""

import json
import os
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drumstick_lab import checkout
from drumstick_lab.checkout import ROOT
from drumstick_lab.measuring.catalogue import sources_of
from drumstick_lab.measuring.source_hash import files_of, source_hash
from drumstick_lab.measuring.this_machine import description, load, real_time_priority

# Every program that stores imports this before it measures.
_BEGAN_S, _BEGAN_AT, _LOAD_BEFORE = time.monotonic(), time.time(), load()
# Code, not what `drumstick lab mesh-peers` stores beside it: what is measured after that would seem to be of edited code.
_MEASURED = (
    "shared", "services", "lab/drumstick_lab", "tests", ":!lab/drumstick_lab/accuracy/peers/stored_peers.json",
)  # fmt: skip


def path(name: str) -> Path:
    """File of a result."""
    return checkout.RESULTS / f"{name}.json"


def is_of_the_checkout() -> bool:
    """True when results go where the pages are made from, and not into another folder."""
    return checkout.OTHER_RESULTS not in os.environ


def exists(name: str) -> bool:
    """True when it was ever stored."""
    return path(name).exists()


def read(name: str) -> dict[str, Any]:
    """Result that a program of the laboratory stored. Raises OSError."""
    return read_file(path(name))


def read_file(file: Path) -> dict[str, Any]:
    """Result in a file. Raises OSError."""
    return json.loads(file.read_text(encoding="utf-8"))


def commit() -> str | None:
    """The checkout's commit, with `-dirty` when the code differs from it; None without git."""
    git = ("git", "-C", str(ROOT))
    try:
        head = subprocess.run(
            [*git, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):  # no git, or installed from an archive
        return None
    same = subprocess.run([*git, "diff", "--quiet", "HEAD", "--", *_MEASURED], check=False).returncode == 0
    return head.stdout.strip() + ("" if same else "-dirty")


def _sources(name: str) -> str | None:
    paths = sources_of(name)
    if not paths or not (ROOT / "shared").is_dir():  # installed without a checkout
        return None
    # Edited meanwhile: nobody knows what was measured.
    changed = any(file.stat().st_mtime > _BEGAN_AT for each in paths for file in files_of(each))
    return None if changed else source_hash(paths)


def of_this_run(name: str) -> dict[str, Any]:
    """Machine, real-time priority, version and sources, load before and after, and seconds since this process began.

    For a result that is about to be stored; `sources` is None when they are not known.
    """
    return {
        **description(),
        "real_time_priority": real_time_priority(),
        "commit": commit(),
        "sources": _sources(name),
        "load_before": _LOAD_BEFORE,
        "load_after": load(),
        "elapsed_s": round(time.monotonic() - _BEGAN_S, 1),
    }


def _text(result: dict[str, Any]) -> str:
    return json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False)


def store(
    name: str,
    found: Mapping[str, Any],
    text: Callable[[dict[str, Any]], str] = _text,
    **more: Any,
) -> dict[str, Any]:
    """Write a result, whole or not at all, behind its machine, to which `more` is added; returns what was written.

    Raises ValueError for a number that is none, OSError.
    """
    rest = {key: value for key, value in found.items() if key != "machine"}
    result = {"machine": {**more, **of_this_run(name)}, **rest}
    beside = path(name).with_suffix(f".{os.getpid()}")
    beside.write_text(text(result) + "\n", encoding="utf-8")
    beside.replace(path(name))
    return result
