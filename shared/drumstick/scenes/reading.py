"""Reading a TOML text, and checking its tables: each mistake names file, line, key, value, limit and unit."""

import difflib
import math
import tomllib
from typing import Any, cast

from drumstick.parameters.declare import Quantity, quantities
from drumstick.scenes.line_numbers import lines_of

MAX_TEXT = 200_000  # characters; scenes have some thousand
_MAX_DOTS = 200  # in one line: Python's reader of TOML needs their square in time for a key a.b.c...
_SHOWN_PATH = 120
_SHOWN = 60  # characters of a value in a message


def tables_of(text: str) -> dict[str, Any]:
    """The tables of a TOML text, whoever wrote it, in bounded time. Raises ValueError, worded."""
    if len(text) > MAX_TEXT:
        raise ValueError(f"it has {len(text)} characters, more than {MAX_TEXT}")
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > _MAX_DOTS:
            raise ValueError(f"line {number} has more than {_MAX_DOTS} dots")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("brackets in brackets, too many to be read") from None


def shown(value: object) -> str:
    """A value that somebody gave, in a message: no more than its beginning."""
    try:
        words = repr(value)
    except (
        ValueError
    ):  # Python reads hexadecimal numbers of any length, and writes none of thousands of digits
        return "a number of thousands of digits"
    except RecursionError:
        return "tables in tables, too many to be shown"
    return words if len(words) <= _SHOWN else f"{words[:_SHOWN]}..."


def _limits(quantity: Quantity) -> str:
    if quantity.kind is str:
        return f"at most {quantity.high:g} characters"
    return f"{quantity.low:g} .. {quantity.high:g} {quantity.unit}"


def _meant(key: str, declared: dict[str, Quantity]) -> str:
    # A key with a typing mistake or in another unit: what the nearest one takes.
    for near in difflib.get_close_matches(key, declared, n=1):
        quantity = declared[near]
        takes = " or ".join(repr(c) for c in quantity.choices) if quantity.choices else _limits(quantity)
        return f"; did you mean {near}, {takes}?"
    return ""


class Reader:
    """Collects mistakes while it checks, and notes: what is read, and should be written otherwise."""

    def __init__(self, source: str, text: str) -> None:
        self.source = source
        self._lines = lines_of(text)
        self.mistakes: list[str] = []
        self.notes: list[str] = []

    def refuse(self, path: str, words: str) -> None:
        """Add a mistake at `path` (table.key)."""
        self.mistakes.append(self._at(path, words))

    def note(self, path: str, words: str) -> None:
        """Add a note at `path`: no mistake."""
        self.notes.append(self._at(path, words))

    def _at(self, path: str, words: str) -> str:
        line, place = None, path
        while line is None and place:  # of a key in a table that stands in braces: where the table begins
            line, place = self._lines.get(place), place.rpartition(".")[0]
        at = f"{self.source}:{line}" if line else self.source
        named = "".join(
            c if c.isprintable() else repr(c)[1:-1] for c in path[:_SHOWN_PATH]
        )  # keys are anybody's
        return f"{at}: {named}: {words}"

    def table(self, path: str, kind: type, given: object) -> Any:
        """The table as its dataclass; defaults where keys are missing or refused."""
        return kind(**self.values(path, kind, given))

    def values(
        self, path: str, kind: type, given: object, also_known: tuple[str, ...] = ()
    ) -> dict[str, Any]:
        """The values that the table really gives and that are good; `also_known` keys are left to the caller."""
        declared = quantities(kind)
        if not isinstance(given, dict):
            self.refuse(path, f"must be a table, not {shown(given)}")
            return {}
        values: dict[str, Any] = {}
        for key, value in cast(dict[str, object], given).items():
            if key in also_known:
                continue
            if key not in declared:
                known = ", ".join((*declared, *also_known))
                meant = _meant(key, declared)
                self.refuse(f"{path}.{key}", f"unknown key, given {shown(value)}{meant}; known here: {known}")
                continue
            checked = self.value(f"{path}.{key}", declared[key], value)
            if checked is not None:
                values[key] = checked
        return values

    def value(self, path: str, quantity: Quantity, value: object) -> Any:
        """The value as its declared type, or None after a refusal."""
        if quantity.choices:
            if isinstance(value, bool) or value not in quantity.choices:
                known = ", ".join(repr(c) for c in quantity.choices)
                self.refuse(path, f"{shown(value)} is not one of {known}")
                return None
            return value
        if quantity.kind is tuple:
            return self._rows(path, quantity, value)
        if quantity.kind is str:
            return self._text(path, quantity, value)
        if quantity.kind is int and (isinstance(value, bool) or not isinstance(value, int)):
            self.refuse(
                path, f"{shown(value)} must be a whole number in {quantity.unit}, {_limits(quantity)}"
            )
            return None
        return self._number(path, quantity, value)

    def _text(self, path: str, quantity: Quantity, value: object) -> str | None:
        most = int(quantity.high)
        if not isinstance(value, str) or len(value) > most or not value.isprintable():
            self.refuse(path, f"{shown(value)} must be one line of text, {_limits(quantity)}")
            return None
        return value

    def _number(self, path: str, quantity: Quantity, value: object) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.refuse(path, f"{shown(value)} must be a number in {quantity.unit}, {_limits(quantity)}")
            return None
        if isinstance(value, float) and not math.isfinite(value):
            self.refuse(path, f"{value!r} must be a finite number in {quantity.unit}, {_limits(quantity)}")
            return None
        if not quantity.low <= value <= quantity.high:
            self.refuse(path, f"{shown(value)} {quantity.unit} is outside {_limits(quantity)}")
            return None
        return quantity.kind(value) if quantity.kind is not tuple else float(value)

    def _rows(self, path: str, quantity: Quantity, value: object) -> Any:
        rows = cast(list[object], value) if isinstance(value, list) else []
        if not isinstance(value, list) or not quantity.fewest <= len(rows) <= 16:
            rows_wanted = f"{quantity.fewest} to 16 rows of {quantity.length} numbers"
            self.refuse(path, f"{shown(cast(object, value))} must be a list of {rows_wanted}")
            return None
        checked: list[tuple[float, ...]] = []
        for row in rows:
            items = cast(list[object], row) if isinstance(row, list) else []
            if len(items) != quantity.length:
                self.refuse(path, f"{shown(cast(object, row))} must be a row of {quantity.length} numbers")
                return None
            numbers = [self._number(path, quantity, item) for item in items]
            if any(n is None for n in numbers):
                return None
            checked.append(tuple(numbers))
        return tuple(checked)
