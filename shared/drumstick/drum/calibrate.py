"""The output level: one full-scale strike at half radius has the same power, whatever the drum and the contact.

A peak depends on the mesh's rate: levelled by it, one drum's meshes differ by 2.7 dB below 4 kHz (median of the shipped
scenes with a mesh, 6 dB at worst), by power 0.3 dB (1.2 dB at worst).
"""

import math
from collections.abc import Sequence

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import Unplayable, copy_of, new_engine
from drumstick.drum.effects.registry import EFFECTS
from drumstick.drum.effects.tension import TensionTable, tension_rise_of_cents
from drumstick.drum.engine import Control, Engine
from drumstick.drum.fitting import fitted
from drumstick.drum.mallets.mallet import full_impulse
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.output.levels import settle
from drumstick.drum.stems.separation import separated
from drumstick.parameters.scene import Scene
from drumstick.stick import contact
from drumstick.stick.law import law_of
from drumstick.stick.records import Law
from drumstick.stick.strike_curve import level_at
from realtime.records import Record, is_there

PEAK_OF_FULL_SCALE = 0.5  # about: 0.3 (a conga) to 0.8
_RMS_OF_FULL_SCALE = 0.175  # of both channels: a median drum then has that peak
_STIFFENINGS, _AS_STIFF, _LEAST_SLOPE = 20, 2e-3, 0.1
_RINGS = 0.02  # of the rise while it is touched
_LONGEST_TOUCH_S = 0.05  # a soft mallet on a slack head
_PERIODS = 2.0  # of the lowest mode, after the contact: the time in which power is taken


def strike_for_speed(
    scene: Scene, speed_m_per_s: float, x: float, y: float, t_s: float = 0.0
) -> OfflineStrike:
    """The blow that the scene's contact law gives at this speed: what a strike message would say."""
    law: Law = law_of(scene)[0]
    m, k, r = float(law["m"]), float(law["k_coll"]), float(law["r_in"])
    peak, release = contact.peak_force(m, k, r, speed_m_per_s), int(law["release"])
    impulse = m * speed_m_per_s * (1.0 + contact.beta(release, m, k, r))
    stroke = stroke_of(scene, speed_m_per_s)
    return OfflineStrike(t_s, x, y, peak, contact.contact_time(release, m, k, r), impulse, stroke)


def stroke_of(scene: Scene, speed_m_per_s: float) -> float:
    """The mallet's speed, m/s, for a strike at this speed of the stick."""
    strike = scene.strike
    if strike.stroke_m_per_s == 0.0:  # and no kernel is compiled for what nobody looks at
        return speed_m_per_s
    return strike.stroke_at(level_at(strike, speed_m_per_s), speed_m_per_s)


def full_scale(scene: Scene) -> OfflineStrike:
    """A strike of level 1 at half radius."""
    return strike_for_speed(scene, scene.strike.full_scale_m_per_s, 0.5, 0.0)


def _gain(scene: Scene, rate_Hz: int, engine: Engine) -> float:
    # A trial run with a gain so small that the limiter stays out of it; the sound is linear in the gain.
    ring = StrikeRing()
    trial = copy_of(engine, ring)
    blow = full_scale(scene)
    # The force and the head's tension of 1 make displacements of about peak * contact / period: far from the knee.
    small = 1e-6 / blow.peak_N
    trial.control["output_gain"] = small
    ring.push_blow(blow)
    length = blow.contact_s + _PERIODS / scene.drum.f01_Hz
    out = np.zeros((round(length * rate_Hz), 2), np.float32)
    render_all(trial, out, len(out), 0)
    rms = float(np.sqrt(np.mean(np.square(out, dtype=np.float64)))) / small
    if not 0.0 < rms < np.inf:
        raise Unplayable(
            f"the drum of {scene.name} cannot be computed: a full-scale strike gave an RMS of {rms}"
        )
    return _RMS_OF_FULL_SCALE / rms


def _stiffen(engine: Engine, kappa: float) -> None:
    if is_there(engine.effects.tension):
        engine.effects.tension.state["kappa"] = kappa


def _pushes(engine: Engine) -> bool:
    # Does a mallet, or a pulse, still push?
    if is_there(engine.mallets):
        return bool((engine.mallets.pool["force"] > 0.0).any())
    control: Control = engine.control[0]
    return bool(control["active"])


def _mean_rises(scene: Scene, engine: Engine, kappa: float) -> tuple[float, float]:
    # By how much of itself the tension rises, on average over the first period after a full-scale stroke has left the
    # head, and while it is touched.
    ring = StrikeRing()
    trial = copy_of(engine, ring)
    assert is_there(trial.effects.tension)
    _stiffen(trial, kappa)
    state: Record = trial.effects.tension.state[0]
    blow = full_scale(scene)
    ring.push_blow(blow)
    control: Control = trial.control[0]
    block = np.zeros((int(control["divisor"]), 2), np.float32)
    steps_per_s = control["rate_Hz"] / control["divisor"]
    touched: list[float] = []
    for step in range(round(_LONGEST_TOUCH_S * steps_per_s)):
        render_all(trial, block, len(block), 0)
        touched.append(float(state["pull"]))
        if step > blow.contact_s * steps_per_s and not _pushes(trial):
            break
    ringing: list[float] = []
    for _ in range(round(steps_per_s / scene.drum.f01_Hz)):
        render_all(trial, block, len(block), 0)
        ringing.append(float(state["pull"]))
    tau = float(state["tau"])
    return float(np.mean(ringing)) / tau, float(np.mean(touched)) / tau


def _asks_for_cents(table: TensionTable) -> bool:
    return table.young_GPa == 0.0 and table.glide_cents > 0.0


def _kappa(scene: Scene, engine: Engine) -> float:
    # With which a stroke of full scale raises the pitch by the scene's cents. On a head that does not stiffen yet the
    # rise goes with kappa; a tighter one is stretched less: the secant, in logarithms.
    target = tension_rise_of_cents(scene.drum.effects["tension"].glide_cents)
    # Where nothing rings once a head so high is let go, it is the rise while it is touched.
    kappa, before = 1e-12, (0.0, 0.0)
    ringing, touched = _mean_rises(scene, engine, kappa)
    rings = ringing > _RINGS * touched
    for turn in range(_STIFFENINGS):
        ringing, touched = _mean_rises(scene, engine, kappa)
        rise = ringing if rings else touched
        if not 0.0 < rise < np.inf:
            raise Unplayable(
                f"the drum of {scene.name} cannot be computed: a full-scale stroke raises its tension by {rise:g}"
            )
        here, short = (math.log(kappa), math.log(rise)), math.log(target / rise)
        if abs(short) < _AS_STIFF:
            return kappa
        slope = (here[1] - before[1]) / (here[0] - before[0]) if turn > 1 and here[0] != before[0] else 1.0
        kappa *= math.exp(short / min(max(slope, _LEAST_SLOPE), 1.0))
        before = here
    raise Unplayable(
        f"the drum of {scene.name} cannot be computed: no stiffness raises the pitch by"
        f" {scene.drum.effects['tension'].glide_cents:g} cents at full scale; ask for less, or name young_GPa"
    )


def _impulse(engine: Engine, blow: OfflineStrike) -> float:
    # That a blow has beside the head, N steps.
    if is_there(engine.mallets):
        return full_impulse(engine.mallets.state[0], blow.speed_m_per_s)
    control: Control = engine.control[0]
    return blow.peak_N * blow.contact_s * 2.0 / math.pi * control["rate_Hz"] / control["divisor"]


def build(scene: Scene, rate_Hz: int, strikes: StrikeRing, apart: Sequence[str] = ()) -> Engine:
    """A calibrated engine at rest, fed from `strikes`. Any thread; blocks some ten milliseconds, and for as long as
    `fitted` does.

    apart: names of pickups or microphones that have a pair of their own (drumstick.drum.stems.separation).
    """
    scene = fitted(scene, rate_Hz).scene
    engine = new_engine(scene, rate_Hz, strikes)
    if "tension" in scene.drum.effects and _asks_for_cents(scene.drum.effects["tension"]):
        _stiffen(engine, _kappa(scene, engine))
    engine.control["output_gain"] = _gain(scene, rate_Hz, engine)
    settle(engine.listening, scene.listen.gain_dB, scene.listen.pan, scene.listen.mute)
    for name, module in EFFECTS.items():
        part = getattr(engine.effects, name, None)
        if is_there(part) and hasattr(module, "set_level"):
            heard = _impulse(engine, full_scale(scene)) * float(engine.control["output_gain"][0])
            heard *= 10.0 ** (scene.listen.gain_dB / 20.0)  # its level is that at the scene's own gain
            module.set_level(part, scene.drum.effects[name], PEAK_OF_FULL_SCALE, heard)
    return separated(engine, scene, apart)
