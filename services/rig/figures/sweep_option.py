"""`--sweep NAME=LOW:HIGH:COUNT[:log]`: one swept parameter as the user wrote it. Raises CommandError with status 2."""

import math
from collections.abc import Sequence

import numpy as np

from drumstick.analysis.cycles.sweep import Axis
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Parameter, Refusal, table_of
from rig.exit_status import usage_error

_FORM = "write NAME=LOW:HIGH:COUNT or NAME=LOW:HIGH:COUNT:log, e.g. dv_pls=0.05:2:100"
MAX_POINTS = 100_000


def _number(text: str, whole: str) -> float:
    try:
        value = float(text)
    except ValueError:
        usage_error(f"--sweep {whole!r}: {text!r} is not a number; {_FORM}")
    if not math.isfinite(value):
        usage_error(f"--sweep {whole!r}: {text!r} is not finite; {_FORM}")
    return value


def _bound(row: Parameter, text: str, whole: str) -> float:
    try:
        return row.check(_number(text, whole))
    except Refusal as refusal:
        usage_error(f"--sweep {whole!r}: {refusal}")


def axis(scene: Scene, whole: str) -> Axis:
    """The axis that one --sweep describes, LOW and HIGH included."""
    name, _, span = whole.partition("=")
    parts = span.split(":")
    if not name or len(parts) not in (3, 4) or parts[3:] not in ([], ["log"]):
        usage_error(f"--sweep {whole!r}: {_FORM}")
    table = table_of(scene)
    if name not in table:
        usage_error(f"--sweep {whole!r}: scene {scene.name!r} has no {name!r}; it has {', '.join(table)}")
    low, high = _bound(table[name], parts[0], whole), _bound(table[name], parts[1], whole)
    if not low < high:
        usage_error(
            f"--sweep {whole!r}: LOW {low:g} must be less than HIGH {high:g} {table[name].quantity.unit}"
        )
    if not parts[2].isdecimal() or not 2 <= int(parts[2]) <= MAX_POINTS:
        usage_error(f"--sweep {whole!r}: COUNT {parts[2]!r} must be a whole number, 2 .. {MAX_POINTS}")
    if len(parts) == 3:
        return Axis(name, np.linspace(low, high, int(parts[2])))
    if not low > 0.0:
        usage_error(f"--sweep {whole!r}: with :log LOW must be above 0, not {low:g}")
    return Axis(name, np.geomspace(low, high, int(parts[2])))


def axes(scene: Scene, given: Sequence[str]) -> list[Axis]:
    """The one or two axes of a sweep."""
    if len(given) > 2:
        usage_error(f"--sweep was given {len(given)} times; once sweeps a line, twice a plane")
    asked = [axis(scene, whole) for whole in given]
    if len(asked) == 2 and asked[0].name == asked[1].name:
        usage_error(f"--sweep: {asked[0].name} was given twice; name two different parameters")
    if {a.name for a in asked} == {"z_h0", "z_ss"}:
        usage_error("--sweep: z_h0 and z_ss are two views of one value: sweep only one of them")
    points = math.prod(len(a.values) for a in asked)
    if points > MAX_POINTS:
        usage_error(f"--sweep: {points} points are too many, at most {MAX_POINTS}; lower a COUNT")
    return asked
