"""All parts of `drumstick accuracy` in turn, with a bar that says what is under way."""

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.peers.windows import versions
from drumstick_lab.measuring.this_machine import description
from realtime.kernels.store import hash_of_all

PARTS = ("stick", "servo", "mesh", "excitation", "effects", "whole")
_WIDTH = 46  # of the words beside the bar


def _jobs(part: str, quick: bool, found: dict[str, Any]) -> list[Job]:
    # Imported late: the command's own start is to be quick, and `--help` imports none of this.
    jobs: Callable[[bool, dict[str, Any]], Iterator[Job]] = import_module(
        f"drumstick_lab.accuracy.{part}"
    ).jobs
    return list(jobs(quick, found))


@contextmanager
def _bar(total: int) -> Generator[Callable[[str, bool], None]]:
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=total)

        def progress(words: str, is_done: bool) -> None:
            bar.update(task, advance=float(is_done), description=f"{words[:_WIDTH]:{_WIDTH}s}")

        yield progress


def begun(quick: bool, parts: tuple[str, ...] = PARTS) -> dict[str, Any]:
    """A result in which every part is still empty, behind the machine that it will hold for."""
    made_by = {"kernels": hash_of_all(), "peers": versions()}
    return {"machine": {**description(), **made_by, "quick": quick}} | {part: {} for part in parts}


def fill(found: dict[str, Any]) -> None:
    """Measure every part of a result that was begun, JSON-ready. Minutes; what raises leaves what is done so far."""
    began = time.monotonic()
    quick: bool = found["machine"]["quick"]
    parts = [part for part in found if part != "machine"]
    work = [(part, job) for part in parts for job in _jobs(part, quick, found[part])]
    with _bar(len(work)) as progress:
        for part, job in work:
            words = f"{part}: {job.words}"
            progress(words, False)
            job.run()
            progress(words, True)
    found["machine"]["seconds"] = round(time.monotonic() - began, 1)
