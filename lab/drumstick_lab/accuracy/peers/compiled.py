"""Peers that are libraries: built here with the distribution's tools, called in this process."""

import ctypes
import math
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt

HERE = Path(__file__).parent
_NATIVE = ["g++", "-O3", "-march=native", "-shared", "-fPIC"]
_MAX_S = 600.0  # Faust's 16 x 16 takes more than a minute


class Library:
    """`run(samples)` of a shared library; what it returns must be a finite number."""

    def __init__(self, path: Path, junctions: int, result: type) -> None:
        self.junctions = junctions
        self._library = ctypes.CDLL(str(path))
        self._library.run.restype = result
        self._library.run.argtypes = [ctypes.c_long]

    def run(self, samples: int) -> None:
        """Compute so many samples. ArithmeticError if the mesh came to no number."""
        if not math.isfinite(self._library.run(samples)):
            raise ArithmeticError("the peer's mesh overflowed")

    def response(self, samples: int) -> npt.NDArray[np.float64]:
        """Signal of the mesh's own pickup after one blow, (samples,); of a library that gives it."""
        out = np.zeros(samples)
        self._library.response(ctypes.c_long(samples), ctypes.c_void_p(out.ctypes.data))
        return out


def _run(command: list[str]) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=_MAX_S)


def stk(folder: Path) -> Library:
    """STK's Mesh2D from libstk as it is installed; only the loop that calls it is compiled here.

    SubprocessError when the compiler refuses.
    """
    out = folder / "stk_mesh.so"
    _run([*_NATIVE, "-o", str(out), str(HERE / "stk_mesh.cpp"), "-lstk"])
    junctions = ctypes.c_int.in_dll(ctypes.CDLL(str(out)), "junctions").value
    return Library(out, junctions, ctypes.c_double)


def faust(folder: Path, side: int) -> Library:
    """Faust's mesh_square of side x side junctions. 8: some seconds to compile; 16: more than a minute.

    SubprocessError when Faust or the compiler refuses.
    """
    source, code, out = (folder / f"faust_{side}.{kind}" for kind in ("dsp", "cpp", "so"))
    text = (HERE / "faust_mesh.dsp").read_text(encoding="utf-8")
    source.write_text(text.replace("SIDE", str(side)), encoding="utf-8")
    _run(["faust", "-a", str(HERE / "faust_mesh.cpp"), str(source), "-o", str(code)])
    _run([*_NATIVE, "-o", str(out), str(code)])
    return Library(out, side * side, ctypes.c_float)
