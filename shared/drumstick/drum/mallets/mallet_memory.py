"""The memory of a scene's mallets, all of them far from the head. Allocates; any thread."""

import numpy as np

from drumstick.drum.length_unit import metres_per_unit_in_air
from drumstick.drum.mallets.patch import radius_on
from drumstick.drum.memory.mallets import MALLET, POOL, STATE, TIP, Mallets, patches_of, shares_of
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from realtime.records import ABSENT, Record, Records


def _tips(mallet: Mallet, step_s: float) -> Records:
    tips: Records = np.zeros(POOL, TIP)
    twice_exponent = 2.0 * mallet.exponent
    tips["stiffness"], tips["exponent"] = mallet.stiffness_N_per_m_p, mallet.exponent
    tips["twice_exponent"] = int(twice_exponent) if twice_exponent.is_integer() else 0
    tips["energy_factor"] = 1.0 / (mallet.exponent + 1.0)
    tips["loss_rate"] = mallet.loss_s_per_m / (2.0 * step_s)
    return tips


def _state_of(scene: Scene, mallet: Mallet, step_s: float) -> Records:
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    fields["unit_m"], fields["step_s"] = metres_per_unit_in_air(scene), step_s
    fields["own_compliance"] = step_s**2 / mallet.mass_kg
    fields["carried"] = fields["foreseen"] = -1
    fields["radius"] = mallet.tip_radius_m / scene.drum.radius_m
    return state


def mallets_on_mesh(scene: Scene, step_s: float, spacing: float) -> Mallets:
    """Mallets for a mesh that steps every step_s, its junctions `spacing` radii apart; None without [mallet]."""
    mallet = scene.mallet
    if mallet is None:
        return ABSENT
    state = _state_of(scene, mallet, step_s)
    state["radius"] = radius_on(spacing, float(state["radius"][0]))
    pool: Records = np.zeros(POOL, MALLET)
    return Mallets(state, pool, _tips(mallet, step_s), patches=patches_of(POOL))


def mallets_on_modes(scene: Scene, step_s: float, modes: int) -> Mallets:
    """Mallets for a bank of so many oscillators that steps every step_s; None without [mallet]."""
    mallet = scene.mallet
    if mallet is None:
        return ABSENT
    pool: Records = np.zeros(POOL, MALLET)
    state = _state_of(scene, mallet, step_s)
    return Mallets(state, pool, _tips(mallet, step_s), shares=shares_of(POOL, modes))
