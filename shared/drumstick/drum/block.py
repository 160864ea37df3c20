"""One drum's audio, block by block: strikes in, mesh forward, pickups out. Kernels of the mixer and offline."""

import math

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition
from drumstick.drum.engine import Control, Engine, Meters
from drumstick.drum.excitation import force_resampling
from drumstick.drum.excitation.analytic import begin, damp
from drumstick.drum.mallets import mallet
from drumstick.drum.memory.listening import Levels
from drumstick.drum.memory.pulses import POOL, ContactPulse
from drumstick.drum.memory.strikes import StrikeEvent
from drumstick.drum.modal import bank
from drumstick.drum.output import stems
from drumstick.drum.output.display_data import show_sound, show_surface
from drumstick.drum.output.levels import glide
from drumstick.drum.output.limiter import limit, limited
from drumstick.drum.output.output_meter import PEAK_FALL_S
from drumstick.drum.output.upsample import TAPS, interpolated, remember
from drumstick.drum.pickups import fade
from drumstick.drum.step import step, wake
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.ring import drain


@njit()
def _start_due(engine: Engine, block_start_ns: int, frames: int) -> None:
    # Moves strikes from the ring to the waiting list, and those that fall into this block to the pool of pulses; also
    # those of the next few samples, because the last step of the mesh in this block covers them already.
    control: Control = engine.control[0]
    control.pending += drain(engine.ring_cells, engine.ring_slots, engine.pending[control.pending :])
    to_next_step = (control.divisor - control.phase) % control.divisor
    kept = 0
    for i in range(control.pending):
        event: StrikeEvent = engine.pending[i]
        offset = 0.0
        if event.onset_ns > 0:
            offset = max(0.0, (event.onset_ns - block_start_ns) * 1e-9 * control.rate_Hz)
        if offset >= frames + control.divisor:
            engine.pending[kept] = engine.pending[i]
            kept += 1
            continue
        if control.asleep != 0:
            wake(engine)
        age = -max(0.0, (offset - to_next_step) / control.divisor)
        if mallet.start(engine, event, age):
            control.begun += 1
            continue
        duration = event.contact_s * control.rate_Hz / control.divisor
        bank.set_strike_weights(engine, control.begun % POOL, event.x, event.y)
        control.begun = begin(engine.pulses, control.begun, event.x, event.y, age, duration, event.peak_N)
        if event.impulse_N_s > 0.0:
            pulse: ContactPulse = engine.pulses[(control.begun - 1) % POOL]
            damp(pulse, engine.contact[0], event.impulse_N_s * control.rate_Hz / control.divisor)
    control.pending = kept


@njit()
def _advance(engine: Engine, ahead: int) -> None:
    # One step of the head, if it sounds at all; the block has so many of them left.
    control: Control = engine.control[0]
    left = right = 0.0
    control.quiet += 1
    if control.asleep == 0:
        control.quiet = 0
        left, right = step(engine, ahead)
    control.history_head = remember(engine.history, control.history_head, left, right)
    stems.remember(engine, control.history_head)


@njit()
def render_block(engine: Engine, out: npt.NDArray[np.float32], block_start_ns: int) -> None:
    """Fill `out`, shape (frames, 2), with the drum's sound from `block_start_ns` (monotonic) on, not limited; (frames,
    2 + 2 S) where it has S stems. The meters show the sum.

    The engine's own thread only; no allocation, no locks, no system calls. The caller sets the float mode. 0 < frames.
    """
    control: Control = engine.control[0]
    meters: Meters = engine.meters[0]
    frames = out.shape[0]
    if control.asleep != 0:
        fade.settle(engine)  # before a strike wakes it
    _start_due(engine, block_start_ns, frames)
    if force_resampling.take(engine, block_start_ns, frames) and control.asleep != 0:
        wake(engine)
    if composition.taken_in(engine, frames) > 0 and control.asleep != 0:
        wake(engine)
    levels: Levels = engine.listening.levels[0]
    left_gain, right_gain = levels.left, levels.right
    glide(engine.listening, frames, control.rate_Hz)
    left_step, right_step = (levels.left - left_gain) / frames, (levels.right - right_gain) / frames
    peak_left = peak_right = 0.0
    sounding = frames
    if control.asleep != 0 and control.quiet > TAPS:  # nothing is left in the interpolator either
        out[:] = np.float32(0.0)
        control.phase = (control.phase + frames) % control.divisor
        sounding = 0
    for i in range(sounding):
        if control.phase == 0:
            _advance(engine, (sounding - i + control.divisor - 1) // control.divisor)
        phase = engine.phases[control.phase]
        left_gain += left_step
        right_gain += right_step
        left = left_gain * control.output_gain * interpolated(engine.history, control.history_head, 0, phase)
        right = (
            right_gain * control.output_gain * interpolated(engine.history, control.history_head, 1, phase)
        )
        beside_left, beside_right = stems.fill(engine, out[i], phase, (left_gain, right_gain))
        control.phase = (control.phase + 1) % control.divisor
        out[i, 0] = left
        out[i, 1] = right
        peak_left = max(peak_left, abs(left + beside_left))
        peak_right = max(peak_right, abs(right + beside_right))
    fall = math.exp(-frames / (PEAK_FALL_S * control.rate_Hz))
    meters.peak_left = max(limited(peak_left), fall * meters.peak_left)
    meters.peak_right = max(limited(peak_right), fall * meters.peak_right)
    show_surface(engine, frames)
    show_sound(engine, out)
    meters.frames += frames
    meters.begun = control.begun


@njit()
def render_unlimited(engine: Engine, out: npt.NDArray[np.float32], block: int, first_ns: int) -> None:
    """Fill `out` block by block without pacing, in the audio float mode, as if it began at `first_ns`."""
    engine = borrowed_view(engine)
    mode = flush_denormals()
    start = 0
    while start < out.shape[0]:
        stop = min(start + block, out.shape[0])
        at = first_ns + int(start * 1e9 / engine.control[0].rate_Hz)
        render_block(engine, out[start:stop], at)
        start = stop
    restore(mode)


@njit()
def render_all(engine: Engine, out: npt.NDArray[np.float32], block: int, first_ns: int) -> None:
    """Like `render_unlimited`; limited."""
    render_unlimited(engine, out, block, first_ns)
    mode = flush_denormals()
    limit(out)
    restore(mode)
