"""Exit statuses of a command: 0 done, 2 what was given is wrong, 3 the machine lacks something, 1 a fault of ours."""

from typing import NoReturn

GIVEN, LACKING, OURS = 2, 3, 1


class CommandError(Exception):
    """Ends the command with one clear message and an exit status."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


def usage_error(message: str) -> NoReturn:
    """Stop with status 2: the user's input is wrong."""
    raise CommandError(GIVEN, message)


def unavailable(message: str) -> NoReturn:
    """The machine lacks something: a free port, a library, a permission."""
    raise CommandError(LACKING, message)
