"""Code, memory and sound of one scene as JSON: a program of its own, which compiles all of it anew.

For `drumstick lab as-called-for`, which runs it on two libraries. A kernel's code is its assembly with symbols numbered,
since their names hold counters of the process.
"""

import gc
import hashlib
import json
import re
import sys
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

import drumstick as ds
from drumstick.drum.calibrate import build
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of

PLAYED_S, RATE_HZ = 0.6, 48_000
_SYMBOL = re.compile(r"_ZN?[\w.$]+|\.L[\w.$]+|\.const[\w.$]+")


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _code(compiled: Any) -> str:
    # Of one kernel, whatever its symbols are called.
    numbers: dict[str, str] = {}
    return _SYMBOL.sub(
        lambda found: numbers.setdefault(found.group(), f"s{len(numbers)}"), compiled.library.get_asm_str()
    )


def kernels() -> dict[str, list[str]]:
    """Digests of the code of every kernel that is compiled, by its name."""
    found: dict[str, list[str]] = {}
    for each in gc.get_objects():
        if isinstance(each, Dispatcher) and each.overloads:
            name = f"{each.py_func.__module__}.{each.py_func.__qualname__}"
            codes = [_digest(_code(compiled).encode()) for compiled in each.overloads.values()]
            found[name] = sorted([*found.get(name, []), *codes])
    return found


def allocated(memory: Any) -> int:
    """Bytes of the arrays in a drum's memory."""
    if isinstance(memory, np.ndarray):
        return memory.nbytes
    return sum(map(allocated, memory)) if isinstance(memory, tuple) else 0


def main() -> None:
    scene = parse(shipped_text(sys.argv[1]), sys.argv[1])
    run = ds.simulate(scene, PLAYED_S)
    sound = ds.render(scene, run, rate_Hz=RATE_HZ)
    engine = build(scene, RATE_HZ, StrikeRing())
    print(
        json.dumps(
            {
                "contacts": _digest(np.ascontiguousarray(run.contacts).tobytes()),
                "sound": _digest(np.ascontiguousarray(sound).tobytes()),
                "stick_bytes": law_of(scene).nbytes,
                "drum_bytes": allocated(engine),
                "kernels": kernels(),
            }
        )
    )


if __name__ == "__main__":
    main()
