"""The bank of modes as points beside the mesh: what it keeps of each mode in float32, and what it costs. Any thread."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from drumstick.drum.build import new_engine, size_of
from drumstick.drum.engine import Control
from drumstick.drum.memory.bank import Bank
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Modal
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.heads import DEVICE_RATE_Hz, sounding
from drumstick_lab.accuracy.drums.modes import MODES, Poles, poles_of
from drumstick_lab.accuracy.timing import Window
from realtime.records import is_there

F01_Hz = Scene("drum").drum.f01_Hz
_UPDATES_A_MODE = 3.0  # a mode costs as much as some junctions


class BankAt(NamedTuple):
    """One bank: what a row tells of it, the poles of its first twenty modes, their due decay, and its window."""

    row: dict[str, Any]
    poles: Poles
    t60_s: float
    window: Window


def bank_poles(bank: Bank, step_s: float) -> Poles:
    """Poles of q' = q + R^2 d - k q, by R^2 and k as the bank keeps them: q(n+1) = (1 + R^2 - k) q(n) - R^2 q(n-1)."""
    at = np.repeat(np.arange(len(bank.orders)), np.where(bank.orders == 0, 1, 2))[:MODES]
    r_squared, stiffness = bank.r_squared[at].astype(np.float64), bank.stiffness[at].astype(np.float64)
    return poles_of(1.0 + r_squared - stiffness, r_squared, step_s)


def banks(tops_Hz: Sequence[float]) -> Iterator[BankAt]:
    """The default drum as a bank of its modes up to each of tops_Hz, which is also its bandwidth."""
    plain = Scene("drum")
    for top_Hz in tops_Hz:
        scene = dataclasses.replace(plain, modal=Modal(top_Hz=top_Hz))
        strikes = StrikeRing()
        engine = new_engine(scene, DEVICE_RATE_Hz, strikes)
        control: Control = engine.control[0]
        control["output_gain"] = 1e-6
        rate_Hz = float(control["rate_Hz"] / control["divisor"])
        assert is_there(engine.modal)
        modes = size_of(engine)
        row: dict[str, Any] = {
            "renderer": "modal",
            "scheme": None,
            "rim": None,
            "precision": "float32",
            "across": None,
            "junctions": modes,
            "rate_Hz": rate_Hz,
            "bandwidth_Hz": top_Hz,
            "measured": True,
        }
        window = sounding(scene, engine, strikes, _UPDATES_A_MODE * modes * rate_Hz / DEVICE_RATE_Hz)
        yield BankAt(row, bank_poles(engine.modal, 1.0 / rate_Hz), scene.drum.t60_s, window)
