"""Python's collection of garbage, put off while a process makes itself ready: a tenth of the processor time of that.

Any ordinary Python thread; of the whole process.
"""

import gc
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def left_lying() -> Generator[None]:
    """Collect nothing meanwhile: for a compile, which makes much that stays, and little garbage."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@contextmanager
def importing() -> Generator[None]:
    """Collect nothing meanwhile, and never look through what is there at the end: modules live as long as the process,
    and no later collection is held up by them."""
    with left_lying():
        yield
        gc.freeze()
