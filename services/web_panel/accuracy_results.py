"""Results of `drumstick accuracy`: the one that comes with the package, and this machine's own. Reads files."""

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.regular_file import read_text

Numbers = npt.NDArray[np.float64]
Pair = tuple[Numbers, Numbers]  # cost and error, shape (n,) each
_MAX_BYTES = 20_000_000
_ROUNDING = 2.0**-52  # an exact method errs by no less; on a logarithmic scale it needs a place
# Of the mesh's rows: what a scene can have. Rows of the stick have none of these keys.
_PLAYED = {"measured": True, "renderer": "mesh", "rim": "weights", "precision": "float32"}
_DRAWN = {
    "pitch": ("mesh", "ns_per_sample", "rms_cents", 0.0),
    "stick": ("stick", "ns_per_s", "error_contacts", _ROUNDING),
}


class Files(NamedTuple):
    """Paths of the two results; None: nowhere."""

    shipped: Path | None = None
    own: Path | None = None


NO_FILES = Files()


class Result(NamedTuple):
    """Machine and date in words; cost (ns) and error of the mesh's pitch (cents) and of the stick (relative)."""

    words: str
    pitch: Pair
    stick: Pair


def read(path: Path | None) -> Result | None:
    """The result; None where there is none. Raises ValueError, in words, for a file that is no such result."""
    if path is None:
        return None
    try:
        found = json.loads(read_text(path, _MAX_BYTES))
        machine = found["machine"]
        words = f"{machine['processor']}, {machine['date']}" + (", quick" if machine["quick"] else "")
        pairs = {name: _pair(found, *where) for name, where in _DRAWN.items()}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise ValueError(f"{path} cannot be read: {str(error)[:200] or type(error).__name__}") from error
    return Result(words[:200], **pairs)


def _pair(found: Any, part: str, cost: str, error: str, least: float) -> Pair:
    # What was measured here, by rising cost; what would lie below `least` is drawn there.
    points: list[tuple[float, float]] = []
    for row in found[part]["rows"]:
        x, y = row[cost], row[error]
        is_own = all(row.get(key, value) == value for key, value in _PLAYED.items())
        if is_own and x is not None and y is not None:
            at = float(x), max(abs(float(y)), least)
            if all(math.isfinite(value) and value > 0.0 for value in at):
                points.append(at)
    points.sort()
    return np.array([x for x, _ in points]), np.array([y for _, y in points])
