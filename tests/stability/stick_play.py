"""A stick played from event to event, and what must hold at each of them whatever its numbers are."""

from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact

MAX_EVENTS = 60


def _finite(record: npt.NDArray[Any]) -> bool:
    return all(
        _finite(record[name]) if record[name].dtype.names else bool(np.all(np.isfinite(record[name])))
        for name in record.dtype.names or ()
    )


def play_on(scene: Scene, v0: float, duration_s: float) -> float:
    """Play up to so many events: no NaN, each moves on, contacts as they can be. The largest speed at an event."""
    law, motion, t, fastest = law_of(scene), thrown(scene, v0), 0.0, abs(v0)
    for _ in range(MAX_EVENTS):
        event, moved = exact.advance(law[0], motion[0], duration_s - t)
        t += moved
        assert 0.0 <= moved <= duration_s
        assert _finite(motion)
        assert motion["contact_phase"][0] != exact.ABOVE or motion["z"][0] >= -1e-12
        if event == exact.RELEASE:
            assert motion["v_in"][0] <= 0.0
            assert motion["v_out"][0] >= -1e-12
            assert motion["peak_N"][0] >= 0.0
            assert motion["z_min"][0] <= 0.0
        fastest = max(fastest, abs(float(motion["v"][0])))
        if event == exact.HORIZON or motion["outcome"][0] != exact.MOVING or t >= duration_s:
            break
    return fastest
