"""Rolls of a hand that changes while it plays: what each grip of its gesture would come to, if it were held still.

Any thread; blocks for some milliseconds a grip once compiled.
"""

from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import settle
from drumstick.parameters.scene import Scene
from drumstick.scenes.recording import Recording
from drumstick.stick import moving_hand
from drumstick.stick.law import law_of

MOST_GRIPS = 32


class Grip(NamedTuple):
    """K_hand (N/m), R_out (N s/m) and z_ss (m) of a gesture at t_s, and the roll that a throw settles in there.

    rate_Hz, v_e_m_per_s: None where it ends otherwise.
    """

    t_s: float
    k_hand_N_per_m: float
    r_out_N_s_per_m: float
    z_ss_m: float
    rate_Hz: float | None
    v_e_m_per_s: float | None


def grips_at(scene: Scene, gesture: Recording, times_s: moving_hand.Numbers) -> tuple[Grip, ...]:
    """Grips of the gesture at these times, s from its beginning, each held still."""
    law, scratch = law_of(scene), scratch_of(scene)
    hand, path = moving_hand.hand_of(scene, gesture), moving_hand.path_of(scene, gesture)
    found: list[Grip] = []
    for t_s in times_s.tolist():
        moving_hand.look(hand[0], path, t_s)
        moving_hand.hold(hand[0], law[0])
        roll = settle(law, scratch, scene.hand.throw_m_per_s).cycle
        rate_Hz, v_e = (None, None) if roll is None else (roll.rate_Hz, roll.v_e_m_per_s)
        k_hand, r_out, z_ss = (float(law[name][0]) for name in ("k_hand", "r_out", "z_ss"))
        found.append(Grip(t_s, k_hand, r_out, z_ss, rate_Hz, v_e))
    return tuple(found)


def grips_of(scene: Scene, gesture: Recording | None) -> tuple[Grip, ...]:
    """Grips at the rows of a gesture, at most MOST_GRIPS, evenly chosen; none without one."""
    if gesture is None:
        return ()
    rows = np.unique(np.linspace(0, len(gesture) - 1, min(len(gesture), MOST_GRIPS)).round().astype(int))
    times_s = gesture[rows, 0]
    times_s[-1] = np.nextafter(times_s[-1], 0.0)  # from its end on the gesture begins anew
    return grips_at(scene, gesture, times_s)
