"""The blows that act now: pulses of the pool, and the junctions that they push in a step."""

from drumstick.drum.membrane.interpolation import CORNERS
from realtime.records import Record, dtype_of

POOL = 32


class ContactPulse(Record):
    """`age` is the time since the onset in mesh steps (negative: still to come); a pulse with age >= duration is over.
    Its force is size e^(-decay p) sin(p + phase), where the angle p goes from 0 to `turn` within the duration.
    """

    x: float
    y: float
    age: float
    duration: float
    turn: float
    phase: float
    decay: float
    size: float  # N
    impulse: float  # N steps


PULSE = dtype_of(ContactPulse)


class ContactDecay(Record):
    """The contact law of the scene, for its pulses: see `damp`."""

    decay: float
    own_decay: float
    pulls: int


CONTACT = dtype_of(ContactDecay)
FORCES = (POOL + 1) * CORNERS  # each pulse, and a streamed force


class JunctionForce(Record):
    """One junction that is pushed in this step, and by how much that moves it."""

    junction: int
    step: float


FORCE = dtype_of(JunctionForce)
