"""The root search where its interval is unkind: the zero lies at an end of it, to the last digit."""

import numpy as np
import numpy.typing as npt

from drumstick.stick.motion.crossing import Weights, point_after, root, start_of
from drumstick.stick.segment import Pulses, Segment
from realtime.kernels.jit import njit

HEIGHT: Weights = (1.0, 0.0, 0.0, 0.0, 0.0)
W2, HORIZON_S = 5000.0 / 0.015, 3e-3
TRIES = 2000


@njit()
def _twice(seg: Segment, horizon: float) -> tuple[float, float, float]:
    # The zero's time and height, and its time when it is looked for once more between the start and itself.
    here = start_of(seg)
    found = root(seg, HEIGHT, here, point_after(seg, horizon))
    return found.t, found.z, root(seg, HEIGHT, here, found).t


def _errors() -> npt.NDArray[np.float64]:
    draw = np.random.default_rng(1)
    errors: list[float] = []
    for _ in range(TRIES):
        depth_m, v, push = 10.0 ** draw.uniform(-7, -3), draw.uniform(0.6, 1.5), draw.uniform(-1500.0, 1500.0)
        pulses: Pulses = ((push, 500.0),)
        t, z, again = _twice(Segment(4.0, W2, 0.0, -depth_m, v, pulses, 0.0, 0.0, 0.0, 0, None), HORIZON_S)
        if (
            z >= 0.0
        ):  # otherwise rounding has put it a digit before the zero, and there is no second one to find
            errors.append(abs(again / t - 1.0))
    return np.array(errors)


def test_a_zero_at_the_end_of_its_interval_keeps_its_digits() -> None:
    errors = _errors()
    assert len(errors) > TRIES // 4
    assert errors.max() < 1e-12
