"""Theory of the roll that is played: its cycle in the phase plane, its return map. Pure; blocks for a second.

Everything is of the exact motion, with the values that the servo uses now.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.fixed_points import fixed_points
from drumstick.analysis.cycles.return_map import OF_V_E, ReturnMap
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.ends import Ends, ends_of
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Z_H0, table_of, with_changes
from drumstick.stick.law import Records, law_of
from drumstick.stick.trajectory import onward
from web_panel.computing.computing_messages import Curve, Theory

Numbers = npt.NDArray[np.float64]

_POINTS, _SPEEDS = 240, 80
_WIDEST = 1.6  # of the fastest stable cycle


def live_law(scene: Scene, values: Mapping[str, float]) -> Records:
    """The scene's law with the servo's own values, shape (1,). Raises Refusal. z_h0 is another view of z_ss."""
    table = table_of(scene)
    return with_changes(law_of(scene), table, {k: v for k, v in values.items() if k != Z_H0 and k in table})


def _in_order(z_mm: Numbers, v: Numbers) -> Curve:
    # By rising height: on the way up, and on the way down, the height changes one way only.
    order = np.argsort(z_mm, kind="stable")
    return z_mm[order].tolist(), v[order].tolist()


def theory_of(scene: Scene, values: Mapping[str, float]) -> Theory:
    """Compute the theory of the scene with these values (SI). Raises Refusal, or ValueError if nothing repeats."""
    wild = [name for name in NEVER_REPEATING if name in scene.effects]
    if wild:
        raise ValueError(f"with {', '.join(wild)} the motion never repeats")
    law, scratch = live_law(scene, values), scratch_of(scene)
    cycles = fixed_points(law, scratch)
    ends = ends_of(scene, law, scratch, cycles)
    stable = sorted((cycle for cycle in cycles if cycle.stable), key=lambda cycle: cycle.v_e_m_per_s)
    single = [cycle.v_e_m_per_s for cycle in stable if cycle.period == 1]
    rising: Curve = ([], [])
    falling: Curve = ([], [])
    if stable:
        cycle = stable[-1]
        return_step.set_state(law[0], scratch[1:], scratch[:1], cycle.states[-1])
        path = onward(law, scratch[:1], cycle.period / cycle.rate_Hz, _POINTS)
        z_mm, up = 1e3 * path.z_m, path.v_m_per_s >= 0.0
        rising = _in_order(z_mm[up], path.v_m_per_s[up])
        falling = _in_order(z_mm[~up], path.v_m_per_s[~up])
    fastest = stable[-1].v_e_m_per_s if stable else scene.hand.throw_m_per_s
    one = ReturnMap(law, scratch, 1, return_step.MAX_WAIT_DOUBLINGS)
    speeds = np.linspace(0.0, _WIDEST * fastest, _SPEEDS)[1:]
    mapped = [(float(v), float(one.measured[0, return_step.V_E])) for v in speeds if one.at(float(v), OF_V_E)]
    return Theory(
        rising,
        falling,
        ([v for v, _ in mapped], [after for _, after in mapped]),
        (single, single),
        _words(ends, stable[-1] if stable else None),
    )


def _words(ends: Ends, roll: Cycle | None) -> str:
    # One line: where strikes lead, and what breaks the roll that is drawn.
    if ends.count == 1:
        return "One stable end: every strike leads to it."
    parts = f"{ends.count} stable ends: a strike decides which."
    limits = ends.limits_of(roll) if roll else None
    if limits is None or limits.least_m_per_s is None:
        return parts
    softer, harder = limits.slowest_m_per_s, limits.fastest_m_per_s
    outside = [f"below {softer:.3g}"] if softer is not None else []
    outside += [f"above {harder:.3g}"] if harder is not None else []
    return f"{parts} A strike {' or '.join(outside)} m/s (now {limits.strike_m_per_s:.3g}) breaks the roll."
