"""Offline simulation by the exact method: the contacts of a stick thrown from z = 0.

Any thread; blocks while it computes.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from drumstick import composition, exact
from drumstick.law import law_of, thrown
from drumstick.scene import Scene
from realtime.jit import Record, njit

End = Literal["time", "captured", "left"]
COLUMNS = (
    "t_in_s",
    "v_in_m_per_s",
    "t_out_s",
    "v_out_m_per_s",
    "v_e_m_per_s",
    "peak_force_N",
    "impulse_N_s",
    "z_min_m",
)
_ENDS: dict[int, End] = {exact.MOVING: "time", exact.CAPTURED: "captured", exact.LEFT: "left"}
_BLOCK = 1024


@dataclass(frozen=True)
class Run:
    """`contacts` has shape (n, 8), columns as COLUMNS, only contacts that ended; `end` says why it stopped."""

    contacts: npt.NDArray[np.float64]
    end: End
    t_end_s: float


@njit()
def _run(
    law: Record, motion: Record, t: float, duration: float, out: npt.NDArray[np.float64]
) -> tuple[int, float]:
    # Fills rows of `out` until it is full, the time is over, or nothing more can happen. Returns rows, t.
    rows = 0
    while rows < out.shape[0] and t < duration and motion.fate == exact.MOVING:
        event, moved = exact.advance(law, motion, duration - t)
        t += moved
        if event == exact.RELEASE:
            row = out[rows]
            row[0] = t - motion.contact_s
            row[1] = motion.v_in
            row[2] = t
            row[3] = motion.v_out
            row[4] = motion.v_out + composition.left(law, motion)
            row[5] = motion.peak_N
            row[6] = motion.impulse_N_s
            row[7] = motion.z_min
            rows += 1
    return rows, t


def simulate(scene: Scene, duration_s: float, v0_m_per_s: float = 0.4) -> Run:
    """Play the scene's stick for `duration_s` from z = 0+ with the upward speed `v0_m_per_s`."""
    law = law_of(scene)
    motion = thrown(scene, v0_m_per_s)
    blocks: list[npt.NDArray[np.float64]] = []
    t = 0.0
    while True:
        out = np.zeros((_BLOCK, len(COLUMNS)))
        rows, t = _run(law[0], motion[0], t, duration_s, out)
        blocks.append(out[:rows])
        if rows < _BLOCK:
            break
    return Run(np.concatenate(blocks), _ENDS[int(motion["fate"][0])], float(t))
