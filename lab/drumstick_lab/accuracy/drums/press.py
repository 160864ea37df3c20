"""A press roll: a hand that goes down pushes the stick into the head, which buzzes against its spring until it rests.

The stick of the roll without its pulse, held firmly; every 0.22 s the hand comes down and stays for a tenth of a second.
Each press is six or seven contacts, 27 ms apart and then less and less, and at last one in which the stick lies in the
head (`PRESS`, `GESTURE`). Exact motion. Any thread; blocks while it computes.
"""

import functools

import numpy as np
import numpy.typing as npt

import drumstick as ds
from drumstick.drum.excitation.offline import StreamedContact
from drumstick.parameters.scene import Scene

PRESS = """
name = "press"
[stick]
m_kg = 0.015
k_coll_N_per_m = 5000.0
r_in_N_s_per_m = 1.3
k_hand_N_per_m = 60.0
r_out_N_s_per_m = 0.1
z_ss_m = -0.03
release = "unilateral"
[hand]
gesture = "recorded"
gesture_file = "press.csv"
[drum]
excitation = "{excitation}"
[listen]
gain_dB = -6.0
"""
GESTURE = "t_s,z_m\n0,0.01\n0.02,-0.03\n0.13,-0.03\n0.2,0.01\n0.22,0.01\n"
LASTS_S = 1.5
_SAMPLES_Hz = 768_000  # of the true force: a multiple of every rate that a stream has here
Numbers = npt.NDArray[np.float64]


def scene(excitation: str = "analytic") -> Scene:
    """The press roll on the default drum, rung by strikes or by the force itself."""
    return ds.scene(PRESS.format(excitation=excitation))


@functools.cache
def run() -> ds.Run:
    """LASTS_S of it."""
    return ds.simulate(scene(), LASTS_S, gesture=GESTURE)


@functools.cache
def _impulse() -> Numbers:
    # N s up to each sample: the head's force by the trapezoidal rule. The force jumps where a contact begins.
    count = round(LASTS_S * _SAMPLES_Hz)
    force = run().motion(np.arange(count + 1) / _SAMPLES_Hz).force_N
    return np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1])) / _SAMPLES_Hz))


def contacts(rate_Hz: float) -> list[StreamedContact]:
    """Its contacts as a servo of that rate would stream them: means over its ticks, closed by 0 N.

    ValueError for a rate that does not divide 768 kHz."""
    each = _SAMPLES_Hz / rate_Hz
    if each != round(each):
        raise ValueError(f"{rate_Hz:g} Hz does not divide {_SAMPLES_Hz} Hz")
    means = np.diff(_impulse()[:: round(each)]) * rate_Hz
    found: list[StreamedContact] = []
    for contact, blow in zip(run().contacts, run().drum_strikes(), strict=True):
        first, last = (int(contact[name] * rate_Hz) for name in ("t_in_s", "t_out_s"))
        forces = np.append(means[first : last + 1], 0.0)
        found.append(StreamedContact(first, rate_Hz, blow.x, blow.y, forces))
    return found
