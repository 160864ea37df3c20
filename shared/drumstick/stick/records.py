"""The records that the kernels get: a scene's law (its parameters) and the stick's motion (its state).

Fields are named as on the wire. Those of an effect are there besides where the scene names it, each with a record of
its own: `drumstick.stick.law` makes the record types of a scene, and an effect says in its module what it sees.
"""

from drumstick.parameters.declare import Quantity
from realtime.records import Record


def field_of(key: str, quantity: Quantity) -> str:
    """The record's field: the wire name without its effect, or the scene's key."""
    return (quantity.wire or key).rpartition(".")[2]


class Law(Record):
    """The parameters of a scene: those of `[stick]`, SI units; `release` is an index among its choices."""

    m: float
    k_coll: float
    r_in: float
    k_hand: float
    r_out: float
    z_ss: float
    release: int
    g_star_m_per_s2: float


class Motion(Record):
    """The state of a stick. `v_in` to `contact_s`: of the present or the last contact; `turned`: 1 from its first
    deepest point on, 0 at its entry. `energy`: m^2/s^2, with the w2 (1/s^2; 0 where it is not kept) and the pull
    (m/s^2) of the equation that it belongs to (drumstick.stick.motion.energy).
    """

    z: float
    v: float
    v_in: float
    v_out: float
    z_min: float
    z_apex: float
    peak_N: float
    impulse_N_s: float
    contact_s: float
    energy: float
    energy_w2: float
    energy_pull: float
    contact_phase: int
    turned: int
    outcome: int
