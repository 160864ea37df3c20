"""Load of one rig that plays the default roll on the wire: each stream's rate, and a message of the true size.

For drumstick lab listeners, which puts it, and drumstick lab scaling-page, which counts it.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from protocol.keys import Keys
from protocol.messages import (
    Contact,
    Cost,
    Membrane,
    Message,
    Meter,
    Release,
    Spectrum,
    State,
    Strike,
    encode,
)

RIG = "listeners"
STRIKES_PER_S = 23.05  # the cycle of the scene `roll`
_CONTACT_PIECES = (
    4  # a contact of 5.5 ms at 1 kHz: seven means of a tick, the last one closing it, two in a message
)
_BOOT, _T_NS = 0x1234_5678_9ABC, 10**15
_ID = "1234-abcdef"
RINGS, SPOKES = 16, 48  # of drumstick.drum.membrane.surface, which would bring a compiler along
_LEVELS = 400


class Stream(NamedTuple):
    """One key. `message` makes the next one from its number and the time, ns."""

    name: str
    per_s: float
    message: Callable[[int, int], Message]

    @property
    def key(self) -> str:
        """Key of the stream."""
        return str(getattr(Keys(RIG), self.name))

    @property
    def payload_bytes(self) -> int:
        """Length of a message."""
        return len(encode(self.message(12_345, _T_NS)))


def _strike(seq: int, t_ns: int) -> Strike:
    return Strike(
        boot=_BOOT, seq=seq, t_ns=t_ns, x=0.31, y=0.12, z_speed_m_per_s=0.628, level=0.314, peak_estimate_N=5.03,
        contact_estimate_s=0.0055, impulse_N_s=0.0157,
    )  # fmt: skip


def _release(seq: int, t_ns: int) -> Release:
    return Release(
        boot=_BOOT, seq=seq, t_ns=t_ns, exit_speed_m_per_s=0.428, impulse_N_s=0.0157, peak_N=5.03, contact_s=0.0055
    )  # fmt: skip


def _contact(seq: int, t_ns: int) -> Contact:
    return Contact(
        boot=_BOOT, seq=seq, first_tick=seq, rate_Hz=1000.0, forces=bytes(8), t_ns=t_ns, x=0.31, y=0.12
    )  # fmt: skip


def _state(seq: int, t_ns: int) -> State:
    return State(
        boot=_BOOT, t_ns=t_ns, status="playing", z_m=0.0123, v_m_per_s=-0.314, force_N=1.23, x=0.31, y=0.12,
        roll_rate_Hz=23.05, v_e_m_per_s=0.628, strikes=seq, ticks=10**6 + seq, overruns=0, lateness_p99_us=87.3,
        lateness_worst_us=312.0, ring_dropped=0, revision=7, pending=False,
    )  # fmt: skip


def _meter(seq: int, t_ns: int) -> Meter:
    return Meter(
        id=_ID, t_ns=t_ns, sink="HDA Intel PCH: ALC257 Analog (hw:0,0)", peak_left=0.31, peak_right=0.28, load=0.12,
        xruns=0, latency_ms=8.31, played=seq, late=0, duplicates=0, arrival_ms=0.81, jitter_ms=0.32,
    )  # fmt: skip


def _membrane(_: int, t_ns: int) -> Membrane:
    heights = np.zeros(1 + RINGS * SPOKES, "<i2").tobytes()
    return Membrane(id=_ID, t_ns=t_ns, rings=RINGS, spokes=SPOKES, unit_m=1.1e-8, heights=heights)


def _spectrum(_: int, t_ns: int) -> Spectrum:
    levels = np.zeros(_LEVELS, "<f4").tobytes()
    return Spectrum(id=_ID, t_ns=t_ns, top_Hz=1200.0, window_s=0.341, levels=levels)


def _cost(_: int, _t_ns: int) -> Cost:
    return Cost(
        id=_ID, words="mesh of 66.6 junctions across (4033) at 16000 Hz", accuracy="standard", mesh_rate_Hz=16000.0,
        across=66.6, share=1.0, cents=2.31,
    )  # fmt: skip


STREAMS = {
    stream.name: stream
    for stream in (
        Stream("strike", STRIKES_PER_S, _strike),
        Stream("release", STRIKES_PER_S, _release),
        Stream("state", 30.0, _state),
        Stream("contact", _CONTACT_PIECES * STRIKES_PER_S, _contact),
        Stream("meter", 10.0, _meter),
        Stream("membrane", 30.0, _membrane),
        Stream("spectrum", 4.0, _spectrum),
        Stream("cost", 4.0, _cost),
    )
}
# What kinds of listeners subscribe to.
PROFILES = {
    "follower": ("strike", "release", "state"),
    "everything": tuple(STREAMS),
}


def per_s(profile: str) -> float:
    """Messages a second to one listener."""
    return sum(STREAMS[name].per_s for name in PROFILES[profile])


def payload_bytes_per_s(profile: str) -> float:
    """Bytes of payload a second to one listener."""
    return sum(STREAMS[name].per_s * STREAMS[name].payload_bytes for name in PROFILES[profile])
