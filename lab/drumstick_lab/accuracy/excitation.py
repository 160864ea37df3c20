"""Excitation of the drum by a strike's message or by the servo's streamed force: error, delay, cost.

Errors are against a contact of the roll, hand and pulse included (drumstick_lab.accuracy.drums.blows), on average over places between
two ticks; of the sound below BAND_Hz, the same for all: twenty modes of the default drum lie there. A servo knows
nothing beyond half of its rate, which a slow one is to show. Latency is from the contact to its force in the
mesh on the audio's own time line, in blocks of 128 samples at 48 kHz, the network left out: a strike waits half a
tick and half a block on average, a stream as long as the sound server delays it.

`magnitude_error_dB` leaves time out: of the spectrum's magnitudes in the same band.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from drumstick.drum.render import render
from drumstick_lab.accuracy.drums import blows, wire_cost
from drumstick_lab.accuracy.drums.blows import Numbers
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.timing import CHAIN, Window, chain, in_turn

RATES_HZ = (500.0, 1000.0, 2000.0, 4000.0)
BAND_Hz = 1000.0
_DEVICE_RATE_HZ = 48_000
_HEARD_S = 0.5
_BEGIN_S = 0.05
_PLACES, _QUICK_PLACES = 8, 2
_ROUNDS, _QUICK_ROUNDS = 30, 8


def _level_dB(off: Numbers, wanted: Numbers) -> float | None:  # noqa: N802
    ratio = float(np.linalg.norm(off) / np.linalg.norm(wanted))
    return 20.0 * math.log10(ratio) if ratio > 0.0 else None


def _mean_dB(levels: list[float | None]) -> float | None:  # noqa: N802
    # Of the errors' powers.
    found = [10.0 ** (level / 10.0) for level in levels if level is not None]
    return 10.0 * math.log10(float(np.mean(found))) if found else None


def blow_sound(rate_Hz: float | None, at_s: float, by_message: bool) -> Any:
    """Sound of the blow at at_s, (n, 2): by its message, or as a stream of the true force; None: at a rate so fine that
    it is the truth."""
    if by_message:
        return render(blows.scene(False), [blows.strike(at_s)], _HEARD_S, _DEVICE_RATE_HZ)
    press = blows.press_of(blows.true_impulse(), at_s, rate_Hz or blows.FINE_RATE_HZ)
    return render(blows.scene(True), [], _HEARD_S, _DEVICE_RATE_HZ, [press])


def _spectrum(rate_Hz: float | None, at_s: float, by_message: bool) -> Any:
    return np.fft.rfft(blow_sound(rate_Hz, at_s, by_message)[:, 0])


def errors(rate_Hz: float, by_message: bool, places: int) -> dict[str, float | None]:
    """force_error_dB, sound_error_dB, magnitude_error_dB; blows lie between the ticks of a servo of rate_Hz."""
    heard = np.fft.rfftfreq(round(_HEARD_S * _DEVICE_RATE_HZ), 1.0 / _DEVICE_RATE_HZ) < BAND_Hz
    of_force: list[float | None] = []
    of_sound: list[float | None] = []
    magnitude: list[float | None] = []
    for k in range(places):
        place = (k + 0.5) / places
        forces = blows.forces_at(place, rate_Hz)
        of_force.append(
            _level_dB((forces.message if by_message else forces.streamed) - forces.true, forces.true)
        )
        at_s = (math.floor(_BEGIN_S * rate_Hz) + place) / rate_Hz
        wanted = _spectrum(None, at_s, False)[heard]
        got = _spectrum(rate_Hz, at_s, by_message)[heard]
        of_sound.append(_level_dB(got - wanted, wanted))
        magnitude.append(_level_dB(np.abs(got) - np.abs(wanted), wanted))
    return {
        "force_error_dB": _mean_dB(of_force),
        "sound_error_dB": _mean_dB(of_sound),
        "magnitude_error_dB": _mean_dB(magnitude),
    }


def _row(rate_Hz: float | None, places: int) -> dict[str, Any]:
    servo_Hz = rate_Hz or float(blows.scene(False).servo.rate_Hz)
    waits_s = 0.5 / servo_Hz + 0.5 * wire_cost.BLOCK_S
    return {
        "kind": "analytic" if rate_Hz is None else "streamed",
        "rate_Hz": rate_Hz,
        **errors(servo_Hz, rate_Hz is None, places),
        "latency_ms": 1e3 * (waits_s if rate_Hz is None else wire_cost.streaming_delay_s()),
        "bytes_per_strike": wire_cost.bytes_of(rate_Hz),
    }


def jobs(quick: bool, found: dict[str, Any]) -> Iterator[Job]:
    """Notes band_Hz, rows and yardstick_ns. `ns_per_strike` is of gateway and sound server, its ratio to the chain."""
    rows: list[dict[str, Any]] = []
    found |= {"band_Hz": BAND_Hz, "rows": rows}
    places = _QUICK_PLACES if quick else _PLACES

    def of(rate_Hz: float | None) -> Job:
        words = "a message" if rate_Hz is None else f"the force at {rate_Hz:g} Hz"
        return Job(f"excitation: {words}", lambda: rows.append(_row(rate_Hz, places)))

    def cost() -> None:
        windows: dict[str, Window] = {CHAIN: chain()}
        for row in rows:
            rate_Hz = row["rate_Hz"]
            windows[str(rate_Hz)] = wire_cost.analytic() if rate_Hz is None else wire_cost.streamed(rate_Hz)
        ns = in_turn(windows, _QUICK_ROUNDS if quick else _ROUNDS)
        found["yardstick_ns"] = {CHAIN: ns[CHAIN]}
        for row in rows:
            spent = ns[str(row["rate_Hz"])]
            row |= {"ns_per_strike": spent, "ratio": spent / ns[CHAIN]}

    for rate_Hz in (None, *RATES_HZ):
        yield of(rate_Hz)
    yield Job("excitation: strikes and pieces on the wire", cost)
