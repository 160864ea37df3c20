"""A piece of the work of `drumstick accuracy`, small enough that a progress bar moves."""

from collections.abc import Callable
from typing import NamedTuple


class Job(NamedTuple):
    """One measurement, in words, and doing it: it notes its result in the part that it was made for."""

    words: str
    run: Callable[[], None]
