"""Everything that sounds, laid out for compiled code: one scene at one device rate.

An Engine belongs to whoever renders it: one thread at a time. Other threads push strikes into its ring and read
`meters`. What a scene does not name is None here, and the compiled code has nothing of it. `drumstick.drum.build` makes
engines.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects.cavity import Cavity
from drumstick.drum.effects.internal_loss import Momentum
from drumstick.drum.effects.muffle import Muffle
from drumstick.drum.effects.rim import Rim
from drumstick.drum.effects.snare import Snare
from drumstick.drum.effects.tension import Tension
from drumstick.drum.excitation.timeline import Stream
from drumstick.drum.mallets.mallet import Mallets
from drumstick.drum.membrane.sweep import Head
from drumstick.drum.modal.bank import Bank
from drumstick.drum.output.microphones import Microphones
from drumstick.drum.output.shown import Shown
from realtime.kernels.jit import Records

PENDING = 256

# What changes while it plays, and the scalars that the kernels need.
CONTROL: np.dtype[Any] = np.dtype(
    [
        ("rate_Hz", "f8"),
        ("divisor", "i8"),
        ("tau", "f8"),
        ("held_back", "f8"),  # 1 + s; 1 with internal losses
        ("order_4", "f4"),  # of A A u, over 1 + s
        ("order_2", "f4"),  # of A u where order_4 is taken, less that
        ("own_gain", "f4"),  # of u in A u, as the weights are baked
        ("now_gain", "f4"),
        ("then_gain", "f4"),
        ("force_gain", "f8"),
        ("output_gain", "f8"),
        ("spread", "i8"),  # 1: a force goes to all the junctions around its place; 0: to the nearest
        ("phase", "i8"),  # device samples since the last step of the mesh
        ("plane", "i8"),  # which of the two planes is the present
        ("head", "i8"),  # newest sample of the interpolator's history
        ("begun", "i8"),  # pulses begun so far
        ("looked", "i8"),  # how many had begun when the pool was last looked through; -1 before
        ("active", "i8"),  # of these, how many still pushed
        ("forces", "i8"),  # junctions that are pushed in this step
        ("pending", "i8"),  # strikes that wait for their instant
        ("steps", "i8"),
        ("asleep", "i8"),  # 1 while the head is at rest and is not computed
        ("quiet", "i8"),  # steps since it fell asleep that the interpolator has heard
        ("loudest", "f8"),  # largest |u| seen since it woke
    ],
    align=True,
)
# Written by the rendering thread, read by any: peaks fall back by themselves, so nobody needs to reset them.
METERS: np.dtype[Any] = np.dtype(
    [("peak_left", "f8"), ("peak_right", "f8"), ("frames", "i8"), ("begun", "i8")], align=True
)


class Engine(NamedTuple):
    """One drum, of a mesh or of a bank of modes. Shapes, with J junctions stored, P pickups and C corners (3 or 4):
    pulses (32,), contact (1,), forces (32 C,), ears (C P,) and their gains (C P, 2), phases (divisor, TAPS),
    history (2, 2 TAPS), pending (256,), ring cells (24,) and slots (256,); bend (J,), for fourth order only."""

    control: Records
    meters: Records
    head: Head  # None where there is a bank of modes
    pulses: Records
    contact: Records
    forces: Records
    ears: npt.NDArray[np.int64]
    ear_gains: npt.NDArray[np.float32]
    phases: npt.NDArray[np.float32]
    history: npt.NDArray[np.float32]
    pending: Records
    ring_cells: npt.NDArray[np.int64]
    ring_slots: Records
    shown: Shown
    modal: Bank | None = None
    microphones: Microphones | None = None
    bend: npt.NDArray[np.float32] | None = None
    internal_loss: Momentum | None = None
    muffle: Muffle | None = None
    tension: Tension | None = None
    cavity: Cavity | None = None
    snare: Snare | None = None
    rim: Rim | None = None
    stream: Stream | None = None
    mallets: Mallets | None = None
