"""Restitution of a contact with every effect in it, beta^(v), and what equation (8) says of a cycle.

    v_{i+1} = alpha (beta + gamma) v_i      (8)

keeps a speed where gamma = 1/alpha - beta. The paper's section 4.2 sets the pulse against the direct alteration
by beta^: a pulse of fixed dv amplifies small blows and leaves large ones to the head, gamma amplifies all alike.

Any thread; blocks for microseconds a speed once compiled.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_step import Numbers
from drumstick.analysis.flight import flight
from drumstick.analysis.rebound import rebound
from drumstick.parameters.scene import Scene
from drumstick.stick import composition
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

# Entry speeds, m/s, that the findings tell beta^ at.
SPEEDS_M_PER_S = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


class Equation8(NamedTuple):
    """Equation (8) at a cycle's own speeds; None where a value does not exist.

    alpha: the hand's, of v_E. beta: the head's, of |v_in|, without pulses. marginal_gamma: 1/alpha - beta. factor:
    alpha (beta + gamma), None without `cor_pulse`. effective_beta: beta^ of a blow at |v_in|, with nothing left of
    earlier pulses.
    """

    alpha: float | None
    beta: float | None
    marginal_gamma: float | None
    factor: float | None
    effective_beta: float | None


@njit()
def _given_back(law: Law, motions: Records, effective: Numbers) -> None:
    for i in range(len(motions)):
        motion, speed = motions[i], abs(motions[i].v)
        measured = np.zeros(return_step.MEASURED_SIZE)
        outcome, _ = return_step.until(law, motion, exact.RELEASE, return_step.FEW_WAIT_DOUBLINGS, measured)
        if outcome == exact.MOVING:
            effective[i] = _v_e(law, motion) / speed


@njit()
def _v_e(law: Law, motion: Motion) -> float:
    return motion.v_out + composition.remaining_speed(law, motion)


def effective_restitution(scene: Scene, v_m_per_s: Numbers) -> Numbers:
    """Effective restitution, beta^ = v_E/|v_in|, of one blow at each speed > 0, shape (n,).

    NaN where the stick stays in the head. v_E counts what pulses still have to give on release. A random force is that
    of the scene's first contact.
    """
    motions = np.repeat(thrown(scene, 0.0), len(v_m_per_s))
    motions["v"] = -np.asarray(v_m_per_s)
    effective = np.full(len(v_m_per_s), np.nan)
    _given_back(law_of(scene)[0], motions, effective)
    return effective


def restitution_without_hand(scene: Scene) -> float | None:
    """Restitution beta^ of the scene's `cor_pulse` alone, without hand; None without one.

    It is what comes of beta + gamma with this tau; all is linear, so it is the same at any speed.
    """
    if "cor_pulse" not in scene.effects:
        return None
    stick = dataclasses.replace(scene.stick, k_hand_N_per_m=0.0, r_out_N_s_per_m=0.0)
    alone = dataclasses.replace(scene, stick=stick, effects={"cor_pulse": scene.effects["cor_pulse"]})
    effective = float(effective_restitution(alone, np.ones(1))[0])
    return effective if np.isfinite(effective) else None


def equation_8(scene: Scene, cycle: Cycle) -> Equation8:
    """Equation (8) at the strongest contact of the cycle."""
    flown, struck = flight(scene, cycle.v_e_m_per_s), rebound(scene, -cycle.v_in_m_per_s)
    alpha, beta = flown.alpha if flown else None, struck.beta if struck else None
    effective = float(effective_restitution(scene, np.array([-cycle.v_in_m_per_s]))[0])
    marginal = factor = None
    if alpha is not None and beta is not None:
        marginal = 1.0 / alpha - beta
        added: CorPulse | None = scene.effects.get("cor_pulse")
        factor = alpha * (beta + added.gamma) if added is not None else None
    return Equation8(alpha, beta, marginal, factor, effective if np.isfinite(effective) else None)
