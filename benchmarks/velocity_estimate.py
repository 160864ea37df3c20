"""Speed from encoder counts, noise against lag: python benchmarks/velocity_estimate.py.

The servo's estimate (haptic_server.servo.velocity) against the plain difference, fixed windows and a first-order
low-pass of the difference, which live here only. A device of 0.03 mm counts at 1 kHz: held still with the noise of a
quarter count, moved evenly at 0.45 to 0.55 m/s, and through a blow at 0.5 m/s on the head of set E, computed exactly.
64 phases of count and tick.
"""

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).parent))

from machine import description

from drumstick import exact
from drumstick.law import law_of, thrown
from drumstick.scene import Scene
from drumstick.stick import Stick
from drumstick.trajectory import onward
from haptic_server.servo.velocity import LONGEST, TRACK, follow
from realtime.jit import Record, njit

RESULT = Path(__file__).parent / "results" / "velocity_estimate.json"
T, COUNT_M, NOISE_COUNTS = 1e-3, 3e-5, 0.25
SPEED, TICKS, PHASES, SETTLED = 0.5, 400, 64, 100
STICK = Stick(0.075, 3500.0, 2.5, 0.0, 0.0, 0.0, "unilateral")
HEIGHT_M, FINE = 0.03, 50  # where the blow begins; instants of the true motion to a tick
LONGEST_LAG_S = 0.02

Samples = npt.NDArray[np.float64]


@njit()
def _followed(track: Record, z: Samples, period_s: float, slack_m: float, out: Samples) -> None:
    for i in range(len(z)):
        out[i] = follow(track, i * period_s, z[i], slack_m)


def adaptive(z: Samples) -> Samples:
    """The servo's own, shape as z; its slack is one count, as the servo gives it."""
    track, out = np.zeros(1, TRACK), np.empty_like(z)
    _followed(track[0], z, T, COUNT_M, out)
    return out


def window(length: int) -> Callable[[Samples], Samples]:
    """The mean speed over so many ticks; 1 is the plain difference."""

    def estimate(z: Samples) -> Samples:
        before = np.concatenate((np.full(length, z[0]), z[:-length]))
        return (z - before) / (length * T)

    return estimate


def low_pass(cutoff_Hz: float) -> Callable[[Samples], Samples]:
    """The plain difference through a first-order low-pass."""
    share = 1.0 - math.exp(-2.0 * math.pi * cutoff_Hz * T)

    def estimate(z: Samples) -> Samples:
        steps, out, speed = window(1)(z), np.empty_like(z), 0.0
        for i, step in enumerate(steps):
            speed += share * (step - speed)
            out[i] = speed
        return out

    return estimate


ESTIMATORS: dict[str, Callable[[Samples], Samples]] = {
    f"adaptive window, up to {LONGEST - 1} ticks (the servo's)": adaptive,
    "plain difference": window(1),
    "fixed window, 4 ticks": window(4),
    "fixed window, 15 ticks": window(LONGEST - 1),
    "low-pass, 100 Hz": low_pass(100.0),
    "low-pass, 20 Hz": low_pass(20.0),
}


def counted(z: Samples) -> Samples:
    return np.round(z / COUNT_M) * COUNT_M


def rms(values: Samples) -> float:
    return float(np.sqrt(np.mean(values**2)))


def still(generator: np.random.Generator) -> Samples:
    """Positions of a stick that is held still, one row for each phase: somewhere in a count, and a little noise."""
    phase = (np.arange(PHASES)[:, None] + 0.5) / PHASES
    return COUNT_M * (phase + NOISE_COUNTS * generator.standard_normal((PHASES, TICKS)))


def steady() -> tuple[Samples, Samples]:
    """Even speeds about SPEED, m/s, one for each phase, and their positions. One speed might fit counts and ticks."""
    speeds = -SPEED * (0.9 + 0.2 * np.random.default_rng(2).random(PHASES))
    phase = (np.arange(PHASES) + 0.5) / PHASES
    return speeds, COUNT_M * phase[:, None] + speeds[:, None] * T * np.arange(TICKS)


def blow(phase: float) -> tuple[Samples, Samples, Samples]:
    """A blow on the head: instants (s), heights (m), speeds (m/s), FINE to a tick; it begins `phase` ticks higher."""
    scene = Scene("blow", stick=STICK)
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["z"], motion["v"], motion["place"] = HEIGHT_M + phase * SPEED * T, -SPEED, exact.ABOVE
    ticks = int(2.0 * HEIGHT_M / SPEED / T)
    seen = onward(law, motion, ticks * T, ticks * FINE + 1)
    return seen.t_s, seen.z_m, seen.v_m_per_s


def late(estimate: Callable[[Samples], Samples]) -> tuple[float, float]:
    """How late it tells the speed during a blow, s (the delay that explains it best), and its rms error then, m/s."""
    delays = np.arange(0.0, LONGEST_LAG_S, T / FINE)
    off, errors = np.zeros(len(delays)), []
    for i in range(PHASES):
        t, z, v = blow(i / PHASES)
        told = estimate(counted(z[::FINE]))
        ticks = t[::FINE]
        inside = np.flatnonzero(z[::FINE] < 0.0)
        met = slice(inside[0], inside[-1] + 1)
        errors.append(told[met] - v[::FINE][met])
        off += [np.mean((told[met] - np.interp(ticks[met] - delay, t, v)) ** 2) for delay in delays]
    return float(delays[np.argmin(off)]), rms(np.concatenate(errors))


def measured(estimate: Callable[[Samples], Samples]) -> dict[str, float]:
    resting = still(np.random.default_rng(1))
    speeds, moving = steady()
    evenly = [estimate(counted(z))[SETTLED:] - speed for speed, z in zip(speeds, moving, strict=True)]
    lag_s, wrong = late(estimate)
    return {
        "still_rms_m_per_s": rms(np.array([estimate(counted(z))[SETTLED:] for z in resting])),
        "steady_rms_m_per_s": rms(np.array(evenly)),
        "lag_s": lag_s,
        "blow_rms_m_per_s": wrong,
    }


def main() -> None:
    rows: dict[str, Any] = {}
    for name, estimate in ESTIMATORS.items():
        rows[name] = measured(estimate)
        print(name, rows[name])
    t, z, _ = blow(0.0)
    result = {
        "machine": description(),
        "period_s": T,
        "count_m": COUNT_M,
        "noise_counts": NOISE_COUNTS,
        "speed_m_per_s": SPEED,
        "contact_s": float(np.count_nonzero(z < 0.0) * (t[1] - t[0])),
        "rows": rows,
    }
    RESULT.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
