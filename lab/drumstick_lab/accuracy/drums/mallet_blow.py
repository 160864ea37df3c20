"""A wooden mallet's blow: the force that it finds on the mesh that plays, beside the one on modes up to TOP_Hz.

A mallet makes its force where it meets the head, so the message is true and what the head gives way is not: a mesh
knows nothing smaller than its spacing. On modes the force under a tip has come to rest (lab/results/refinement.json).
Any thread; blocks while it computes.
"""

import dataclasses
from typing import Any

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
from drumstick_lab.accuracy.drums import blows
from drumstick_lab.accuracy.drums.heads import sounding
from drumstick_lab.accuracy.timing import Window, in_turn

TOP_Hz = 20_000.0
_RATE_Hz = 48_000
_SPAN_S, _BEGIN_S, _HEARD_S = 0.03, 0.05, 0.5  # in the first a contact of wood has passed
_ROUNDS = 6
Forces = npt.NDArray[np.float64]


def _excited(kind: Any, modes: bool = False) -> Scene:
    scene = blows.scene(False)
    return dataclasses.replace(
        scene,
        drum=dataclasses.replace(scene.drum, excitation=kind),
        mallet=Mallet() if kind == "mallet" else None,
        modal=Modal(top_Hz=TOP_Hz) if modes else None,
    )


def forces(on_modes: bool) -> Forces:
    """Force of the roll's stroke by a mallet at each sample, N, shape (n,)."""
    scene, ring = _excited("mallet", on_modes), StrikeRing()
    engine = build(scene, _RATE_Hz, ring)
    assert engine.mallets is not None
    divisor, pool = int(engine.control["divisor"][0]), engine.mallets.pool
    out, found = np.zeros((divisor, 2), np.float32), list[float]()
    ring.push_blow(strike_for_speed(scene, blows.roll().speed_m_per_s, *blows.PLACE))
    for _ in range(round(_SPAN_S * _RATE_Hz) // divisor):
        render_all(engine, out, divisor, 0)
        found += divisor * [float(pool["force"][0])]
    return np.array(found)


def sound(on_modes: bool) -> Any:
    """Sound of these forces on the default mesh, (n, 2): all but the force is alike."""
    contact = StreamedContact(
        round(_BEGIN_S * _RATE_Hz), float(_RATE_Hz), *blows.PLACE, np.append(forces(on_modes), 0.0)
    )
    return render(_excited("streamed"), [], _HEARD_S, _RATE_Hz, [contact])


def extra_share() -> float:
    """Share of a core that a mallet adds to the drum's rendering beside a pulse, struck some sixteen times a second."""
    windows: dict[str, Window] = {}
    for kind in ("analytic", "mallet"):
        scene, ring = _excited(kind), StrikeRing()
        engine = build(scene, _RATE_Hz, ring)
        updates = size_of(engine) / int(engine.control["divisor"][0])
        windows[kind] = sounding(scene, engine, ring, updates)
    ns = in_turn(windows, _ROUNDS)
    return max(ns["mallet"] - ns["analytic"], 0.0) * 1e-9 * _RATE_Hz
