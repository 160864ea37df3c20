"""Report of a broken rule, and the rules that effects and devices share."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

from numba.core.errors import NumbaError

from realtime.kernels.jit import allocations


class NotConforming(AssertionError):
    """An effect or a device that breaks a rule: its name, the rule's, and what was seen.

    rule: as in the table of docs/extend.md. An AssertionError, so that a test fails by it.

    >>> from drumstick import testing
    >>> try:
    ...     testing.check_effect("triangle")
    ... except testing.NotConforming as broken:
    ...     print(broken.rule, "|", broken)
    declaration | triangle: declaration: no effect of that name, neither the instrument's own nor an installed package's
    """

    def __init__(self, name: str, rule: str, words: str) -> None:
        super().__init__(f"{name}: {rule}: {words}")
        self.rule = rule


@contextmanager
def declared(name: str) -> Generator[None]:
    """A ValueError in here is a mistake in what was declared."""
    try:
        yield
    except ValueError as error:
        raise NotConforming(name, "declaration", str(error)) from error


@contextmanager
def compiled_rules(name: str) -> Generator[None]:
    """Kernels that are called in here must compile, and not raise."""
    try:
        yield
    except NumbaError as error:
        raise NotConforming(name, "compiles", str(error)) from error
    except Exception as error:  # compiled code may raise what its author wrote
        raise NotConforming(name, "raises nothing", f"{type(error).__name__}: {error}") from error


def require_no_allocation(name: str, briefly: Callable[[], object], for_long: Callable[[], object]) -> None:
    """Run a compiled kernel both ways: it must take no more memory for long, or it takes some as it plays."""
    taken: list[int] = []
    for kernel in (briefly, for_long):
        before = allocations()
        kernel()
        taken.append(allocations() - before)
    if taken[1] > taken[0]:
        raise NotConforming(
            name, "allocates nothing", f"{taken[1] - taken[0]} arrays were made while it played"
        )
