"""Headings and captions of figures: the scene, what its pulse does, and parameters by their own declarations."""

from collections.abc import Collection

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import table_of, values_of
from drumstick.stick.effects.cor_pulse import CorPulse
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of
from rig.figures.style import Scale

_WHEN = {"entry": "at entry", "turn": "at the deepest point", "exit": "at exit"}


def _pulse(effect: Pulse | CorPulse, size: str, without: Collection[str]) -> str:
    lasts = "" if "tau" in without else f", τ = {effect.tau_s * 1e3:g} ms"
    return f"pulse {size}{'up' if effect.sign > 0 else 'down'} {_WHEN[effect.trigger]}{lasts}"


def effect_words(scene: Scene, without: Collection[str] = ()) -> str:
    """The scene's effects in a few words, e.g. "pulse 0.2 m/s up at exit, τ = 2 ms"; `without` names what is swept."""
    words: list[str] = []
    for name, effect in scene.effects.items():
        if isinstance(effect, Pulse):
            words.append(
                _pulse(effect, "" if "dv_pls" in without else f"{effect.dv_m_per_s:g} m/s ", without)
            )
        elif isinstance(effect, CorPulse):
            over = "/β" if effect.scale == "speed_over_beta" else ""
            size = "" if "gamma" in without else f"{effect.gamma:g} |v_in|{over} "
            words.append(_pulse(effect, size, without))
        else:
            words.append(name.replace("_", " "))
    return "; ".join(words) or "no pulse"


def heading(scene: Scene, subject: str, without: Collection[str] = ()) -> str:
    """The title of a figure, two lines."""
    return f"{scene.name}: {subject}\n{effect_words(scene, without)}"


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
    """Scale of these values, shape (n,): True when they are spaced by equal ratios rather than by equal steps."""
    if len(values) < 3 or not (values > 0.0).all():
        return "linear"
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return "log" if np.ptp(ratios) / ratios.mean() < np.ptp(steps) / steps.mean() else "linear"
