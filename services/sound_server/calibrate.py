"""The output level: one full-scale strike at half radius peaks near 0.5, whatever the drum and the contact."""

import numpy as np

from drumstick import contact
from drumstick.law import law_of
from drumstick.scene import Scene
from realtime.jit import Record
from sound_server.engine import Engine, new_engine
from sound_server.events import StrikeRing
from sound_server.render import Blow, render_all

PEAK_OF_FULL_SCALE = 0.5
_PERIODS = 2.0  # of the lowest mode: the peak has passed by then


def blow_at(scene: Scene, speed_m_per_s: float, x: float, y: float, t_s: float = 0.0) -> Blow:
    """The blow that the scene's contact law gives at this speed: what a strike message would say."""
    law: Record = law_of(scene)[0]
    m, k, r = float(law["m"]), float(law["k_coll"]), float(law["r_in"])
    peak = contact.peak_force(m, k, r, speed_m_per_s)
    return Blow(t_s, x, y, peak, contact.contact_time(int(law["release"]), m, k, r))


def full_scale(scene: Scene) -> Blow:
    """A strike of level 1 at half radius."""
    return blow_at(scene, scene.strike.full_scale_m_per_s, 0.5, 0.0)


def _gain(scene: Scene, rate_Hz: int) -> float:
    # A trial run with a gain so small that the limiter stays out of it; the sound is linear in the gain.
    ring = StrikeRing()
    trial = new_engine(scene, rate_Hz, ring)
    blow = full_scale(scene)
    # The force and the head's tension of 1 make displacements of about peak * contact / period: far from the knee.
    small = 1e-6 / blow.peak_N
    trial.control["output_gain"] = small
    ring.push(0, blow.x, blow.y, blow.peak_N, blow.contact_s)
    length = blow.contact_s + _PERIODS / scene.drum.f01_Hz
    out = np.zeros((round(length * rate_Hz), 2), np.float32)
    render_all(trial, out, len(out), 0)
    peak = float(np.abs(out).max()) / small
    if not 0.0 < peak < np.inf:
        raise ArithmeticError(f"calibration: a full-scale strike gave a peak of {peak}")
    return PEAK_OF_FULL_SCALE / peak


def build(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    """A calibrated engine at rest, fed from `strikes`. Any thread; blocks some ten milliseconds."""
    engine = new_engine(scene, rate_Hz, strikes)
    engine.control["output_gain"] = _gain(scene, rate_Hz) * 10.0 ** (scene.listen.gain_dB / 20.0)
    return engine
