"""Entry points of installed packages: looked up by one name, and only when no effect or device of ours has it."""

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
# Groups of entry points.
EFFECTS, DEVICES = "drumstick.effects", "drumstick.devices"


class PackageError(ValueError):
    """An installed package that gives what was asked for, and cannot be used; says which, and why."""


def entry_of(group: str, name: str) -> "EntryPoint | None":
    """The entry point of this name; None when no package has one. PackageError when several have."""
    from importlib.metadata import entry_points  # nobody waits for it whose scene needs no package

    found = tuple(entry_points(group=group, name=name))
    if len(found) > 1:
        packages = ", ".join(sorted(_package(point) for point in found))
        raise PackageError(
            f"{len(found)} installed packages give a {name}: {packages}; uninstall all but one"
        )
    return found[0] if found else None


def _package(point: "EntryPoint") -> str:
    return point.dist.name if point.dist is not None else point.module


def load(group: str, name: str, kind: type[T]) -> tuple[T, str] | None:
    """The object that an installed package gives by this name, and its module's name; None when none does.

    PackageError when its package cannot be imported, whatever it raises, or gives something else.
    """
    point = entry_of(group, name)
    if point is None:
        return None
    where = f"the installed package {_package(point)} ({point.value})"
    try:
        given = point.load()
    except (Exception, SystemExit) as error:  # another's code may raise anything
        raise PackageError(f"{where} cannot be used: {type(error).__name__}: {error}") from error
    if not isinstance(given, kind):
        raise PackageError(f"{where} gives a {type(given).__name__}, where a ds.{kind.__name__} is wanted")
    return given, point.module
