"""The driver's own protection: asked for, and read back, because a setpoint is no readback. Control thread.

It stands behind our guard, not in its place. Force output itself is enabled only by `run`, and off again after it.
"""

from typing import NamedTuple

from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.protocol import DeviceError

_MM_PER_M = 1e3
_MS_PER_S = 1e3
# Clamping: more force than there is saturates, and is no error in mid-roll. Ramping: amplifiers that drop out come back
# slowly. The software limits watch speed and impulse.
_WANTED = {
    names.MAX_FORCE_CLAMPING: "clamping to the maximum force",
    names.FORCE_RAMPING: "force ramping",
    names.SOFTWARE_FORCE_LIMIT: "software limits of speed and impulse",
    names.ONE_FRAME_LIMIT: "one frame a tick",
}


class Limits(NamedTuple):
    """The driver's software limits in SI units; inf where it tells none."""

    speed_m_per_s: float
    slew_N_per_s: float
    ramp_N_per_s: float

    def words(self) -> str:
        """Sentences for a technician."""
        return (
            f"the driver's own limits: {self.speed_m_per_s:.3g} m/s, {self.slew_N_per_s:.4g} N/s in force, "
            f"ramp back {self.ramp_N_per_s:.3g} N/s (a pulse that rises faster is a fault)"
        )


def protect(hd: Hd) -> list[str]:
    """Switch every protection on; returns words about those that did not come on."""
    words: list[str] = []
    for capability, called in _WANTED.items():
        is_on = hd.enable(capability, True)
        errors = hd.errors()
        if errors or not is_on:
            reason = f": {errors[0]}" if errors else ""
            words.append(f"{called} could not be switched on{reason}")
    return words


def output_force(hd: Hd, wanted: bool) -> None:
    """Switch the motors' output on or off. DeviceError when the driver does not do it."""
    is_on = hd.enable(names.FORCE_OUTPUT, wanted)
    errors = hd.errors()
    if errors or is_on != wanted:
        reason = f": {errors[0]}" if errors else ""
        raise DeviceError(f"force output could not be switched {'on' if wanted else 'off'}{reason}")


def _positive(hd: Hd, what: int, scale: float) -> float:
    value = hd.doubles(what)[0] * scale
    return value if not hd.errors() and value > 0.0 else float("inf")


def limits(hd: Hd) -> Limits:
    """Read the software limits."""
    return Limits(
        _positive(hd, names.SOFTWARE_VELOCITY_LIMIT, 1.0 / _MM_PER_M),
        _positive(hd, names.SOFTWARE_FORCE_IMPULSE_LIMIT, _MS_PER_S),
        _positive(hd, names.FORCE_RAMPING_RATE, 1.0),
    )
