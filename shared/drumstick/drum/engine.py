"""Everything that sounds, laid out for compiled code: one scene at one device rate.

An Engine belongs to whoever renders it: one thread at a time. Other threads push strikes into its ring, read `meters`
and write what parts keep as `target` (`set_live`). What a scene does not name is None here, and the compiled code has
nothing of it. `drumstick.drum.build` makes engines.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.sweep import Head
from drumstick.drum.memory.bank import Bank, Blocks
from drumstick.drum.memory.display import DisplayBuffers
from drumstick.drum.memory.listening import Listening
from drumstick.drum.memory.mallets import Mallets
from drumstick.drum.memory.microphones import Microphones
from drumstick.drum.memory.pickup_fade import PickupFade
from drumstick.drum.memory.pulses import ContactDecay, ContactPulse, JunctionForce
from drumstick.drum.memory.shared_sweep import SharedSweep
from drumstick.drum.memory.stems import Stems
from drumstick.drum.memory.strikes import StrikeEvent
from drumstick.drum.memory.timeline import Stream
from drumstick.stick.law import drum_field
from realtime.records import ABSENT, Float32, Record, Rows, dtype_of

PENDING = 256
OUTSIDE_FRAMES = 1024  # the longest block in which other drums are heard


class Control(Record):
    """Values that change while it plays, and the scalars that the kernels need."""

    rate_Hz: float
    divisor: int
    tau: float
    loss_divisor: float  # 1 + s; 1 with internal losses
    order_4: Float32  # of A A u, over 1 + s
    order_2: Float32  # of A u where order_4 is taken, less that
    own_gain: Float32  # of u in A u, as the weights are baked
    u_gain: Float32
    u_old_gain: Float32
    force_gain: float
    output_gain: float
    spread: int  # 1: a force goes to all the junctions around its place; 0: to the nearest
    phase: int  # device samples since the last step of the mesh
    present_level: int  # which of the head's two time levels is u
    history_head: int  # newest sample of the interpolator's history
    begun: int  # pulses begun so far
    begun_at_last_scan: int  # how many had begun when the pool was last looked through; -1 before
    active: int  # of these, how many still pushed
    forces: int  # junctions that are pushed in this step
    pending: int  # strikes that wait for their instant
    steps: int
    asleep: int  # 1 while the head is at rest and is not computed
    quiet: int  # steps since it fell asleep that the interpolator has heard
    loudest: float  # largest |u| seen since it woke


CONTROL = dtype_of(Control)


class Meters(Record):
    """Written by the rendering thread, read by any: peaks fall back by themselves, so nobody needs to reset them."""

    peak_left: float
    peak_right: float
    frames: int
    begun: int


METERS = dtype_of(Meters)


class Engine(NamedTuple):
    """One drum, of a mesh or of a bank of modes. Shapes, with J junctions stored, P pickups and C corners (3 or 4):
    pulses (32,), contact (1,), forces (32 C,), pickups (C P,), twice as many where they move, and their gains (C P, 2),
    phases (divisor, TAPS), history (2, 2 TAPS), pending (256,), ring cells (24,) and slots (256,); laplacian (J,), for
    fourth order only."""

    control: Rows[Control]
    meters: Rows[Meters]
    head: Head  # None where there is a bank of modes
    pulses: Rows[ContactPulse]
    contact: Rows[ContactDecay]
    forces: Rows[JunctionForce]
    pickups: npt.NDArray[np.int64]
    pickup_gains: npt.NDArray[np.float32]
    phases: npt.NDArray[np.float32]
    history: npt.NDArray[np.float32]
    pending: Rows[StrikeEvent]
    ring_cells: npt.NDArray[np.int64]
    ring_slots: Rows[StrikeEvent]
    listening: Listening
    shown: DisplayBuffers
    effects: Any  # a named tuple: memory of each effect that the scene names, None for all others
    modal: Bank = ABSENT
    blocks: Blocks = ABSENT  # nor where a tension couples few modes
    microphones: Microphones = ABSENT
    laplacian: npt.NDArray[np.float32] = ABSENT
    stream: Stream = ABSENT
    mallets: Mallets = ABSENT
    stems: Stems = ABSENT  # nor where all is heard by one pair
    pickup_fade: PickupFade = ABSENT  # nor where pickups stay
    shared_sweep: SharedSweep = ABSENT  # nor where one thread computes the mesh


def set_live(engine: Engine, name: str, value: float) -> None:
    """Let the drum move to this value of what has that wire name. Any thread; it moves when it plays next."""
    parts: tuple[object, ...] = (*engine.effects, engine.listening)
    field = drum_field(name)
    for part in parts:
        target = getattr(part, "target", None)
        if target is not None and field in target.dtype.names:
            target[field] = value


def hears_others(engine: Engine) -> bool:
    """True if an effect takes in the sound of other drums."""
    return any(hasattr(part, "outside") for part in engine.effects)


def hearing(engine: Engine, outside: npt.NDArray[np.float32]) -> Engine:
    """The same engine, which takes in other drums' sound from `outside`, shape (1024,), where an effect does."""
    parts = (part._replace(outside=outside) if hasattr(part, "outside") else part for part in engine.effects)
    return engine._replace(effects=type(engine.effects)(*parts))
