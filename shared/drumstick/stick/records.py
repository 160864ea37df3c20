"""The records that the kernels get: a scene's law (its parameters) and the stick's motion (its state).

Fields are named as on the wire. Those of an effect are there only where the scene names it: `drumstick.stick.law` makes
the record types of a scene.
"""

from typing import TYPE_CHECKING

from realtime.records import Record

if TYPE_CHECKING:
    from drumstick.stick.effects.chaos import ChaosLaw, ChaosState
    from drumstick.stick.effects.cor_pulse import CorPulseLaw
    from drumstick.stick.effects.hysteretic_spring import HystereticSpringLaw, HystereticSpringState
    from drumstick.stick.effects.kick import Push
    from drumstick.stick.effects.negative_damping import NegativeDampingLaw, NegativeDampingState
    from drumstick.stick.effects.noise import NoiseLaw, NoiseState
    from drumstick.stick.effects.pulse import PulseLaw
    from drumstick.stick.effects.system_delay import SystemDelayLaw, SystemDelayState


class StickLaw(Record):
    """`[stick]` in compiled code, SI units; `release` is an index among its choices."""

    m: float
    k_coll: float
    r_in: float
    k_hand: float
    r_out: float
    z_ss: float
    release: int
    g_star_m_per_s2: float


class StickMotion(Record):
    """The stick's motion. `v_in` to `contact_s` are of the present or the last contact; `turned`: once in each."""

    z: float
    v: float
    v_in: float
    v_out: float
    z_min: float
    z_apex: float
    peak_N: float
    impulse_N_s: float
    contact_s: float
    place: int
    turned: int
    fate: int


class Law(StickLaw):
    """The parameters of a scene."""

    pulse: "PulseLaw"
    cor_pulse: "CorPulseLaw"
    system_delay: "SystemDelayLaw"
    hysteretic_spring: "HystereticSpringLaw"
    negative_damping: "NegativeDampingLaw"
    noise: "NoiseLaw"
    chaos: "ChaosLaw"


class Motion(StickMotion):
    """The state of a scene's stick and effects."""

    pulse: "Push"
    cor_pulse: "Push"
    system_delay: "SystemDelayState"
    hysteretic_spring: "HystereticSpringState"
    negative_damping: "NegativeDampingState"
    noise: "NoiseState"
    chaos: "ChaosState"
