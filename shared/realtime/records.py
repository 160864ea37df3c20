"""Records that compiled code and numpy share, each declared once: a class whose annotated fields are the record's.

`dtype_of` makes numpy's record type of such a class, from which the compiler takes its own; the class itself is what
kernels annotate, so that the type checker knows every field. No record is ever an instance of its class: it is a row
of a numpy array, read as `row.field` in kernels and as `row["field"]` in Python.
"""

from typing import Annotated, Any, Protocol, TypeVar, get_args, get_origin, get_type_hints, overload

import numpy as np
import numpy.typing as npt

# A field of single precision: compiled code meets it as either.
Float32 = Annotated[Any, "f4"]

# In a named tuple of arrays, what this scene does not have: None. Kernels that touch it are compiled only where it is
# there (`only_with`), so its field has the type that it has then; `is_there` asks in Python.
ABSENT: Any = None
# The same for parts that come and go with a module, the drum's effects: a None is as long as an address in compiled
# code, this has no length, so that memory is laid out as if the module were not installed.
NOTHING: Any = ()


def is_there(part: object) -> bool:
    """True when this scene has that part of a named tuple."""
    return part is not ABSENT and part is not NOTHING


class Record:
    """Base class of all records: a class of annotated fields, float or int, for memory that compiled code works on.

    >>> import drumstick as ds
    >>> class Arm(ds.Record):
    ...     z_m: float
    ...     counts: int
    """

    def __getitem__(self, field: str) -> Any:
        """The field of that name, in Python."""
        raise TypeError(f"{type(self).__name__} is a record's type")

    def __setitem__(self, field: str, value: Any) -> None:
        """Set the field of that name, in Python."""
        raise TypeError(f"{type(self).__name__} is a record's type")


R = TypeVar("R", covariant=True)


class Rows(Protocol[R]):
    """An array of records of one class, shape (n,): a row by its number, or one field of all rows by its name."""

    @overload
    def __getitem__(self, row: int, /) -> R: ...
    @overload
    def __getitem__(self, rows: slice, /) -> "Rows[R]": ...
    @overload
    def __getitem__(self, field: str, /) -> npt.NDArray[Any]: ...
    def __setitem__(self, row: Any, value: Any, /) -> None: ...
    def __len__(self) -> int: ...

    @property
    def shape(self) -> tuple[int, ...]:
        """(n,)."""
        ...

    @property
    def size(self) -> int:
        """n."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """numpy's type of a row."""
        ...

    @property
    def nbytes(self) -> int:
        """Bytes of all rows."""
        ...

    def copy(self) -> "Rows[R]":
        """Copy of the rows in memory of their own."""
        ...

    def tobytes(self) -> bytes:
        """All rows, byte for byte."""
        ...


# Rows of any record: what a ring or a triple buffer carries.
Records = Rows[Any]


def _kind(hint: Any) -> Any:
    # What numpy makes of an annotation.
    if get_origin(hint) is Annotated:
        return get_args(hint)[1]
    if hint is float:
        return "f8"
    if hint is int:
        return "i8"
    if isinstance(hint, type) and issubclass(hint, Record):
        return dtype_of(hint)
    raise TypeError(f"a record has no field of the type {hint!r}: float, int, another record, or Annotated")


def fields_of(record: type[Record]) -> list[tuple[Any, ...]]:
    """Name and numpy type of each field, in the order of declaration, those of base classes first.

    An annotation Annotated[..., "f4"] or Annotated[..., "f8", (8,)] gives numpy's type and shape itself.
    """
    fields: list[tuple[Any, ...]] = []
    for name, hint in get_type_hints(record, include_extras=True).items():
        shape = get_args(hint)[2:] if get_origin(hint) is Annotated else ()
        fields.append((name, _kind(hint), *shape))
    return fields


def dtype_of(record: type[Record]) -> np.dtype[Any]:
    """numpy's type of a record, aligned as C aligns it. TypeError for an annotation that no record can have."""
    return np.dtype(fields_of(record), align=True)
