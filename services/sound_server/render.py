"""One drum's audio: strikes in, mesh forward, pickups out. The stage and the offline renderer run this text."""

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drumstick.scene import Scene
from realtime.float_mode import flush_denormals, restore
from realtime.jit import Record, njit
from realtime.lent import lend
from realtime.ring import drain
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.excitation import POOL, begin, bend
from sound_server.limiter import limit, limited
from sound_server.modal import bank
from sound_server.shown import show_sound, show_surface
from sound_server.step import step
from sound_server.stream import playing
from sound_server.stream.offline import Press, Score
from sound_server.upsample import TAPS, interpolated, remember

_PEAK_FALL_S = 0.3


@njit()
def _start_due(engine: Engine, block_start_ns: int, frames: int) -> None:
    # Moves strikes from the ring to the waiting list, and those that fall into this block to the pool of pulses; also
    # those of the next few samples, because the last step of the mesh in this block covers them already.
    control: Record = engine.control[0]
    control.pending += drain(engine.ring_cells, engine.ring_slots, engine.pending[control.pending :])
    to_next_step = (control.divisor - control.phase) % control.divisor
    kept = 0
    for i in range(control.pending):
        event: Record = engine.pending[i]
        offset = 0.0
        if event.onset_ns > 0:
            offset = max(0.0, (event.onset_ns - block_start_ns) * 1e-9 * control.rate_Hz)
        if offset >= frames + control.divisor:
            engine.pending[kept] = engine.pending[i]
            kept += 1
            continue
        age = -max(0.0, (offset - to_next_step) / control.divisor)
        duration = event.contact_s * control.rate_Hz / control.divisor
        bank.aim(engine, control.begun % POOL, event.x, event.y)
        control.begun = begin(engine.pulses, control.begun, event.x, event.y, age, duration, event.peak_N)
        if event.impulse_N_s > 0.0:
            pulse: Record = engine.pulses[(control.begun - 1) % POOL]
            bend(pulse, engine.contact[0], event.impulse_N_s * control.rate_Hz / control.divisor)
        control.asleep = 0
    control.pending = kept


@njit()
def _advance(engine: Engine) -> None:
    # One step of the mesh, if it sounds at all.
    control: Record = engine.control[0]
    left = right = 0.0
    control.quiet += 1
    if control.asleep == 0:
        control.quiet = 0
        left, right = step(engine)
    control.head = remember(engine.history, control.head, left, right)


@njit()
def render_block(engine: Engine, out: npt.NDArray[np.float32], block_start_ns: int) -> None:
    """Fill `out`, shape (frames, 2), with the drum's sound from `block_start_ns` (monotonic) on, not limited.

    The engine's own thread only; no allocation, no locks, no system calls. The caller sets the float mode. 0 < frames.
    """
    control: Record = engine.control[0]
    meters: Record = engine.meters[0]
    frames = out.shape[0]
    _start_due(engine, block_start_ns, frames)
    playing.take(engine, block_start_ns, frames)
    peak_left = peak_right = 0.0
    sounding = frames
    if control.asleep != 0 and control.quiet > TAPS:  # nothing is left in the interpolator either
        out[:] = np.float32(0.0)
        control.phase = (control.phase + frames) % control.divisor
        sounding = 0
    for i in range(sounding):
        if control.phase == 0:
            _advance(engine)
        phase = engine.phases[control.phase]
        left = control.output_gain * interpolated(engine.history, control.head, 0, phase)
        right = control.output_gain * interpolated(engine.history, control.head, 1, phase)
        control.phase = (control.phase + 1) % control.divisor
        out[i, 0] = left
        out[i, 1] = right
        peak_left = max(peak_left, abs(left))
        peak_right = max(peak_right, abs(right))
    fall = math.exp(-frames / (_PEAK_FALL_S * control.rate_Hz))
    meters.peak_left = max(limited(peak_left), fall * meters.peak_left)
    meters.peak_right = max(limited(peak_right), fall * meters.peak_right)
    show_surface(engine, frames)
    show_sound(engine, out)
    meters.frames += frames
    meters.begun = control.begun


@njit()
def render_all(engine: Engine, out: npt.NDArray[np.float32], block: int, first_ns: int) -> None:
    """Fill `out` block by block without pacing, in the audio float mode, as if it began at `first_ns`; limited."""
    engine = lend(engine)
    mode = flush_denormals()
    start = 0
    while start < out.shape[0]:
        stop = min(start + block, out.shape[0])
        at = first_ns + int(start * 1e9 / engine.control[0].rate_Hz)
        render_block(engine, out[start:stop], at)
        start = stop
    limit(out)
    restore(mode)


@dataclass(frozen=True)
class Blow:
    """One strike for the offline renderer: when, where (in radii), how hard, how long; 0 N s: a half-sine."""

    t_s: float
    x: float
    y: float
    peak_N: float  # noqa: N815
    contact_s: float
    impulse_N_s: float = 0.0  # noqa: N815


_BLOCK = 128
# Offline time begins at one second, because an onset of 0 ns would mean "at once".
_EPOCH_NS = 1_000_000_000


def parts(
    scene: Scene, strikes: Iterable[Blow], duration_s: float, rate_Hz: int, presses: Iterable[Press] = ()
) -> Iterator[npt.NDArray[np.float32]]:
    """The sound of `strikes` on the scene's drum as every sink would play it, a quarter of a second at a time.

    Shape (n, 2); the same array again and again. Equal strikes give equal samples, on one machine. `presses` are for a
    scene that streams; then the parts are a hundredth of a second long. Any thread.
    """
    from sound_server.calibrate import build

    ring = StrikeRing()
    engine = build(scene, rate_Hz, ring)
    frames = round(duration_s * rate_Hz)
    played = list(presses)
    score = Score(engine, played, _EPOCH_NS) if played else None
    part = np.zeros((max(rate_Hz // (4 if score is None else 100), 1), 2), np.float32)
    waiting = deque(sorted(strikes, key=lambda blow: blow.t_s))
    done = 0
    while done < frames:
        out = part[: frames - done]
        until_s = (done + len(out)) / rate_Hz
        while waiting and waiting[0].t_s < until_s:
            blow = waiting[0]
            onset = _EPOCH_NS + round(blow.t_s * 1e9)
            if not ring.push(onset, blow.x, blow.y, blow.peak_N, blow.contact_s, blow.impulse_N_s):
                break
            waiting.popleft()
        if score is not None:
            score.give(until_s)
        render_all(engine, out, _BLOCK, _EPOCH_NS + round(done * 1e9 / rate_Hz))
        done += len(out)
        yield out


def render(
    scene: Scene, strikes: Iterable[Blow], duration_s: float, rate_Hz: int, presses: Iterable[Press] = ()
) -> npt.NDArray[np.float32]:
    """`parts` in one piece, shape (n, 2)."""
    found = [part.copy() for part in parts(scene, strikes, duration_s, rate_Hz, presses)]
    return np.concatenate(found) if found else np.zeros((0, 2), np.float32)
