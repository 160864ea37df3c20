"""A mallet's blow: the force that it finds on the drum that plays, beside the one on as many modes as fit.

A mallet makes its force where it meets the head, so the message is true and what the head gives way is not: a mesh
knows nothing smaller than its spacing, a bank nothing above its top. On modes the force under a tip has come to rest
(lab/results/refinement.json). Any thread; blocks while it computes.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_all
from drumstick.drum.build import size_of
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.accuracy.drums import blows
from drumstick_lab.accuracy.drums.heads import sounding
from drumstick_lab.accuracy.timing import Window, in_turn

_TOP_Hz = (
    20_000.0  # or as far as a bank under a mallet reaches: to 17.6 kHz for wood, 14.4 kHz on the timpano
)
_RATE_Hz = 48_000
_SPAN_S, _BEGIN_S, _HEARD_S = 0.03, 0.05, 0.5  # in the first a contact has passed
_ROUNDS = 6
Forces = npt.NDArray[np.float64]


class Struck(NamedTuple):
    """A blow: scenes of the drum that plays and of the one by modes, the mesh that sounds by either force, and how the
    stick struck."""

    played: Scene
    by_modes: Scene
    heard: Scene
    speed_m_per_s: float
    place: tuple[float, float]


def wood() -> Struck:
    """The roll's stroke by a wooden mallet on the default mesh."""
    played = _excited(blows.scene(False), "mallet")
    by_modes = dataclasses.replace(played, modal=Modal(top_Hz=_TOP_Hz))
    heard = _excited(blows.scene(False), "streamed")
    return Struck(played, by_modes, heard, blows.roll().speed_m_per_s, blows.PLACE)


def felt() -> Struck:
    """A stroke of half its full scale by the felt mallet of scene `timpani`, on its bank of modes. It is heard on a plain
    mesh of its head's pitch: a bank takes no stream."""
    played = parse(shipped_text("timpani"), "timpani")
    by_modes = dataclasses.replace(played, modal=Modal(top_Hz=_TOP_Hz))
    plain = dataclasses.replace(played, modal=None, drum=dataclasses.replace(played.drum, effects={}))
    speed = 0.5 * played.strike.full_scale_m_per_s
    return Struck(played, by_modes, _excited(plain, "streamed"), speed, (played.hand.orbit_radius, 0.0))


def _excited(scene: Scene, kind: Any) -> Scene:
    drum = dataclasses.replace(scene.drum, excitation=kind)
    mallet = (scene.mallet or Mallet()) if kind == "mallet" else None
    return dataclasses.replace(scene, drum=drum, mallet=mallet)


def forces(struck: Struck, by_modes: bool) -> Forces:
    """Force at each sample, N, shape (n,)."""
    scene, ring = struck.by_modes if by_modes else struck.played, StrikeRing()
    engine = build(scene, _RATE_Hz, ring)
    assert engine.mallets is not None
    divisor, pool = int(engine.control["divisor"][0]), engine.mallets.pool
    out, found = np.zeros((divisor, 2), np.float32), list[float]()
    ring.push_blow(strike_for_speed(scene, struck.speed_m_per_s, *struck.place))
    for _ in range(round(_SPAN_S * _RATE_Hz) // divisor):
        render_all(engine, out, divisor, 0)
        found += divisor * [float(pool["force"][0])]
    return np.array(found)


def sound(struck: Struck, by_modes: bool) -> Any:
    """Sound of these forces on one mesh, (n, 2): all but the force is alike."""
    told = np.append(forces(struck, by_modes), 0.0)
    contact = StreamedContact(round(_BEGIN_S * _RATE_Hz), float(_RATE_Hz), *struck.place, told)
    return render(struck.heard, [], _HEARD_S, _RATE_Hz, [contact])


def extra_share(played: Scene) -> float:
    """Share of a core that a mallet adds to a drum's rendering beside a pulse, struck ten to sixteen times a second."""
    windows: dict[str, Window] = {}
    for kind in ("analytic", "mallet"):
        scene, ring = _excited(played, kind), StrikeRing()
        engine = build(scene, _RATE_Hz, ring)
        updates = size_of(engine) / int(engine.control["divisor"][0])
        windows[kind] = sounding(scene, engine, ring, updates)
    ns = in_turn(windows, _ROUNDS)
    return max(ns["mallet"] - ns["analytic"], 0.0) * 1e-9 * _RATE_Hz
