"""Cost of one evaluation of the stick's closed-form motion: the unit in which `exact` is counted."""

import time

import bounces
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion.crossing import point_after
from drumstick.stick.motion.transitions import segment_of
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

_POINTS = 20_000
_WINDOWS = 20


@njit()
def _points(law: Law, motion: Motion, count: int) -> float:
    seg = segment_of(law, motion, None)
    total = 0.0
    for i in range(count):
        total += point_after(seg, 1e-3 + 1e-7 * i).z6
    return total


def point_ns(name: str) -> float:
    """CPU time, ns, of a point: height, speed and five derivatives, with the scene's pulse going on."""
    scene = bounces.CASES[name].scene
    law, motion = law_of(scene), thrown(scene, bounces.THROW_M_PER_S)
    motion["pulse"]["acceleration"] = scene.effects["pulse"].dv_m_per_s / scene.effects["pulse"].tau_s
    best = float("inf")
    for _ in range(_WINDOWS):
        begun = time.thread_time_ns()
        _points(law[0], motion[0], _POINTS)
        best = min(best, (time.thread_time_ns() - begun) / _POINTS)
    return best
