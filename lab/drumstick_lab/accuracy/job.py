"""A piece of the work of `drumstick accuracy`, small enough that a progress bar moves."""

from collections.abc import Callable
from typing import NamedTuple


class Job(NamedTuple):
    """What is done, in words, and doing it: it notes what it finds in the part of the result that it was made for."""

    words: str
    run: Callable[[], None]
