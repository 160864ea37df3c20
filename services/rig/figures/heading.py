"""What stands above and beside a figure: the scene, what its pulse does, and parameters by their own declarations."""

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from drumstick.effects.pulse import Pulse
from drumstick.law import law_of
from drumstick.parameters import table_of, values_of
from drumstick.scene import Scene
from rig.figures.style import Scale

_WHEN = {"entry": "at entry", "turn": "at the deepest point", "exit": "at exit"}


def pulse_words(scene: Scene, without: Collection[str] = ()) -> str:
    """The scene's pulse in a few words, e.g. "pulse 0.2 m/s up at exit, τ = 2 ms"; `without` names swept parameters."""
    pulse = scene.effects.get("pulse")
    if not isinstance(pulse, Pulse):
        return "no pulse"
    size = "" if "dv_pls" in without else f"{pulse.dv_m_per_s:g} m/s "
    lasts = "" if "tau" in without else f", τ = {pulse.tau_s * 1e3:g} ms"
    return f"pulse {size}{'up' if pulse.sign > 0 else 'down'} {_WHEN[pulse.trigger]}{lasts}"


def heading(scene: Scene, subject: str, without: Collection[str] = ()) -> str:
    """The title of a figure."""
    return f"{scene.name}: {subject}   ({pulse_words(scene, without)})"


def axis_label(scene: Scene, name: str) -> str:
    """A parameter's words, symbol and unit."""
    quantity = table_of(scene)[name].quantity
    words = quantity.words.partition(":")[0]
    base, _, below = (quantity.symbol or name).partition("_")
    symbol = rf"${base}_\mathrm{{{below.replace('_', ' ')}}}$" if below else base
    unit = "" if quantity.unit in ("", "1") else f"  ({quantity.unit})"
    return f"{words[0].lower()}{words[1:]}  {symbol}{unit}"


def own_value(scene: Scene, name: str) -> float:
    """The scene's own value of a parameter, NaN where it has none."""
    table = table_of(scene)
    return values_of(law_of(scene), table)[name]


def scale_of(values: npt.NDArray[np.float64]) -> Scale:
    """Are these values, shape (n,), spaced by equal ratios rather than by equal steps?"""
    if len(values) < 3 or not (values > 0.0).all():
        return "linear"
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return "log" if np.ptp(ratios) / ratios.mean() < np.ptp(steps) / steps.mean() else "linear"
