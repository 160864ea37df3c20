"""Size of one strike on the wire, and the cost of passing it on: in the gateway and in the sound server. Any thread."""

from collections.abc import Callable
from typing import Any

import numpy as np

from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.memory.timeline import stream_of
from drumstick_lab.accuracy.drums import blows
from drumstick_lab.accuracy.timing import Window, spent_ns
from haptic_server.contacts import SAMPLE
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from protocol.clock import HapticClock
from protocol.messages import Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.contacts import ContactScheduler
from sound_server.receiving.strikes import StrikeScheduler

_STRIKES = 20  # in a window: their pieces fit into the ring of a stream
_APART_S = 0.05
_BOOT = 0x1234_5678_9ABC
# As on a rig that has played for a while: msgpack writes small numbers shorter.
_LATE_SEQ, _LATE_NS, _LATE_TICK = 12_345, 10**15, 10**9
BLOCK_S = 128 / 48_000


def _message(seq: int, t_ns: int) -> bytes:
    blow = blows.strike(0.0)
    return encode(
        Strike(
            boot=_BOOT,
            seq=seq,
            t_ns=t_ns,
            x=blow.x,
            y=blow.y,
            z_speed_m_per_s=blows.roll().speed_m_per_s,
            level=0.5,
            peak_estimate_N=blow.peak_N,
            contact_estimate_s=blow.contact_s,
            impulse_N_s=blow.impulse_N_s,
        )
    )


def _scheduler() -> StrikeScheduler:
    scheduler = StrikeScheduler(StrikeRing(), RateLimitedLog(lambda: 0), lambda _boot: None)
    scheduler.clock = HapticClock(_BOOT, 0, 0)
    return scheduler


def _contact_scheduler() -> ContactScheduler:
    scheduler = ContactScheduler(RateLimitedLog(lambda: 0), lambda _boot: None)
    stream = stream_of(blows.scene(True), 1.0 / 16_000.0)
    stream.state["block_ns"] = round(BLOCK_S * 1e9)
    scheduler.play_on(stream, 0.0)
    scheduler.clock = HapticClock(_BOOT, 0, 0)
    return scheduler


def streaming_delay_s() -> float:
    """Delay from a tick to its force in the mesh, as the sound server plays a stream in blocks of 128 samples at 48 kHz."""
    return _contact_scheduler().delay_s


def _samples(seq: int, rate_Hz: float) -> Any:
    # One contact as the servo's ring has it.
    press = blows.press_of(blows.true_impulse(), seq * _APART_S, rate_Hz)
    samples = np.zeros(len(press.forces_N), SAMPLE)
    samples["seq"], samples["tick"] = seq, press.first_tick + np.arange(len(samples))
    samples["t_ns"] = np.round(samples["tick"] / rate_Hz * 1e9)
    samples["force_N"], samples["x"], samples["y"] = press.forces_N, press.x, press.y
    return samples


def _encoded(samples: Any, rate_Hz: float) -> list[bytes]:
    return [encode(piece) for piece in Pieces(rate_Hz).of(_BOOT, samples, int(samples["t_ns"][-1]))]


def bytes_of(rate_Hz: float | None) -> float:
    """Bytes of the payloads of one strike; with rate_Hz, its force's pieces too."""
    strike = len(_message(_LATE_SEQ, _LATE_NS))
    if rate_Hz is None:
        return float(strike)
    samples = _samples(1, rate_Hz)
    samples["seq"] = _LATE_SEQ
    samples["t_ns"] += _LATE_NS
    samples["tick"] += _LATE_TICK
    return float(strike + sum(map(len, _encoded(samples, rate_Hz))))


def _passing(work: Callable[[int], None]) -> float:
    def all_of_them() -> None:
        for seq in range(1, _STRIKES + 1):
            work(seq)

    return spent_ns(all_of_them) / _STRIKES


def analytic() -> Window:
    """ns of a strike: encoded in the gateway, taken in the sound server."""

    def window() -> float:
        scheduler = _scheduler()

        def work(seq: int) -> None:
            t_ns = round(seq * _APART_S * 1e9)
            scheduler.take(_message(seq, t_ns), t_ns)

        return _passing(work)

    return window


def streamed(rate_Hz: float) -> Window:
    """ns of a strike whose force follows it, in pieces: the strike tells the place, the pieces are played."""
    contacts = {seq: _samples(seq, rate_Hz) for seq in range(1, _STRIKES + 1)}

    def window() -> float:
        scheduler, contact_scheduler = _scheduler(), _contact_scheduler()
        scheduler.note = contact_scheduler.note

        def work(seq: int) -> None:
            samples = contacts[seq]
            t_ns = int(samples["t_ns"][0])
            scheduler.take(_message(seq, t_ns), t_ns)
            for payload in _encoded(samples, rate_Hz):
                contact_scheduler.take(payload, t_ns)

        spent = _passing(work)
        if contact_scheduler.played != _STRIKES or contact_scheduler.refused or contact_scheduler.late:
            raise ValueError(f"{contact_scheduler.played} of {_STRIKES} contacts were played")
        return spent

    return window
