import numpy as np
import numpy.typing as npt
import pytest

from realtime.kernels import float_mode
from realtime.kernels.jit import njit


@njit()
def halved(x: npt.NDArray[np.float32]) -> int:
    mode = float_mode.flush_denormals()
    x[0] *= np.float32(0.5)
    float_mode.restore(mode)
    x[1] *= np.float32(0.5)
    return mode


@pytest.mark.skipif(not float_mode.HAS_MODE, reason="only x86-64 has this mode")
def test_denormals_are_zero_in_between_and_back_afterwards() -> None:
    smallest = np.finfo(np.float32).tiny
    x = np.array([smallest, smallest], np.float32)
    halved(x)
    assert x[0] == 0.0
    assert x[1] == smallest / 2
    assert np.float32(smallest) * np.float32(0.5) > 0.0
