"""Facts about an open PHANTOM, in SI units and the paper's frame. Control thread.

The driver's units for stiffness and damping are not documented with certainty, and position resolution cannot be asked
for. Where a number has to be interpreted, the words say what was read and how it was taken.
"""

import math
from typing import NamedTuple

from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.openhaptics.frame import MM
from haptic_server.servo.device.openhaptics.rates import FIREWIRE_RATES_HZ
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.specification import Specification

# Walls between 0.1 and 20 N/mm are what these arms are sold for: a smaller number can only be N/mm, a larger one N/m.
_MAX_STIFFNESS_N_PER_MM = 20.0
_MAX_DAMPING_N_S_PER_MM = 0.05
# Second-hand figures, by what a model's name contains; the first that fits.
_RESOLUTION_M = {"premium": 3e-5, "touch x": 2.3e-5, "desktop": 2.3e-5, "touch": 5.5e-5, "omni": 5.5e-5}
_COARSEST_M = 5.5e-5
_SOFTEST_N_PER_M = 1000.0
# The usable workspace of the smallest arm, lowest and highest corner in mm, for a driver that tells none.
_SMALLEST_MM = (-80.0, -60.0, -35.0, 80.0, 60.0, 35.0)
_TEXTS = {
    "model": names.DEVICE_MODEL_TYPE,
    "maker": names.DEVICE_VENDOR,
    "serial number": names.DEVICE_SERIAL_NUMBER,
    "driver": names.DEVICE_DRIVER_VERSION,
    "HD library": names.VERSION,
}


class Facts(NamedTuple):
    """specification; centre_mm: the middle of the usable workspace in the device's frame; words for a technician."""

    specification: Specification
    centre_mm: tuple[float, float, float]
    words: tuple[str, ...]


def _number(hd: Hd, what: int) -> float:
    """A positive number, or nan where the driver tells none."""
    value = hd.doubles(what)[0]
    return value if not hd.errors() and 0.0 < value < math.inf else math.nan


def in_si(value: float, largest_in_mm: float) -> float:
    """A stiffness or damping that may come per mm or per m, per m; `largest_in_mm` is the most it can be per mm."""
    return value / MM if value <= largest_in_mm else value


def _box(hd: Hd, words: list[str]) -> tuple[float, ...]:
    for what in (names.USABLE_WORKSPACE_DIMENSIONS, names.MAX_WORKSPACE_DIMENSIONS):
        box = hd.doubles(what, 6)
        if not hd.errors() and all(10.0 < box[i + 3] - box[i] < 3000.0 for i in range(3)):
            return tuple(box)
    words.append("the driver tells no workspace that makes sense: that of the smallest arm is taken")
    return _SMALLEST_MM


def _resolution(model: str, words: list[str]) -> float:
    for part, resolution in _RESOLUTION_M.items():
        if part in model.lower():
            return resolution
    words.append(f'no resolution is known for the model "{model}": {_COARSEST_M * 1e3:g} mm is taken')
    return _COARSEST_M


def _stiffness(hd: Hd, words: list[str]) -> float:
    value = _number(hd, names.NOMINAL_MAX_STIFFNESS)
    if math.isnan(value):
        words.append(f"the driver tells no nominal stiffness: {_SOFTEST_N_PER_M:.0f} N/m is taken")
        return _SOFTEST_N_PER_M
    taken = in_si(value, _MAX_STIFFNESS_N_PER_MM)
    words.append(f"nominal stiffness {value:g} as the driver tells it, taken as {taken:.0f} N/m")
    return taken


def _damping(hd: Hd, words: list[str]) -> float:
    value = _number(hd, names.NOMINAL_MAX_DAMPING)
    if math.isnan(value):
        words.append("the driver tells no nominal damping")
        return math.inf
    taken = in_si(value, _MAX_DAMPING_N_S_PER_MM)
    words.append(f"nominal damping {value:g} as the driver tells it, taken as {taken:.3g} N s/m")
    return taken


def read(hd: Hd) -> Facts:
    """Ask the current device for everything. DeviceError where a number that safety needs is missing."""
    texts = {called: hd.text(what) for called, what in _TEXTS.items()}
    hd.errors()
    words = [", ".join(f"{called} {text}" for called, text in texts.items() if text)]
    force = _number(hd, names.NOMINAL_MAX_FORCE)
    if math.isnan(force):
        raise DeviceError("the driver tells no nominal maximum force: is the device configured?")
    continuous = _number(hd, names.NOMINAL_MAX_CONTINUOUS_FORCE)
    box = _box(hd, words)
    size = tuple((box[i + 3] - box[i]) * MM for i in range(3))
    specification = Specification(
        name=texts["model"] or "PHANTOM",
        workspace_m=(size[0], size[2], size[1]),
        resolution_m=_resolution(texts["model"], words),
        max_force_N=force,
        continuous_force_N=min(force, continuous) if not math.isnan(continuous) else force,
        stiffness_N_per_m=_stiffness(hd, words),
        damping_N_s_per_m=_damping(hd, words),
        rates_Hz=FIREWIRE_RATES_HZ,
    )
    centre = tuple(0.5 * (box[i] + box[i + 3]) for i in range(3))
    return Facts(specification, (centre[0], centre[1], centre[2]), tuple(words))
