"""Speed from encoder counts, noise against lag: drumstick lab velocity-estimate.

The servo's estimate (haptic_server.servo.force.velocity) against the plain difference, fixed windows and a first-order
low-pass of the difference (drumstick_lab.accuracy.sticks.filters). A device of 0.03 mm counts at 1 kHz: held still with the noise of a
quarter count, moved evenly at 0.45 to 0.55 m/s, and through a blow at 0.5 m/s on the head of set E, computed exactly.
64 phases of count and tick.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.trajectory import onward
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE, Samples, estimated_speeds
from drumstick_lab.measuring import stored
from haptic_server.servo.force.velocity import LONGEST

T, COUNT_M, NOISE_COUNTS = 1e-3, 3e-5, 0.25
SPEED, TICKS, PHASES, SETTLED = 0.5, 400, 64, 100
STICK = Stick(0.075, 3500.0, 2.5, 0.0, 0.0, 0.0, "unilateral")
HEIGHT_M, FINE = 0.03, 50  # where the blow begins; instants of the true motion to a tick
MAX_LAG_S = 0.02


def _by(name: str) -> Callable[[Samples], Samples]:
    # The filter's slack is one count, as the servo gives it.
    return lambda z: estimated_speeds(name, z, T, COUNT_M)


# By the words that the page shows.
ESTIMATORS: dict[str, Callable[[Samples], Samples]] = {
    f"adaptive window, up to {LONGEST - 1} ticks (the servo's)": _by(ADAPTIVE),
    "plain difference": _by("difference"),
    "fixed window, 4 ticks": _by("window of 4"),
    f"fixed window, {LONGEST - 1} ticks": _by(f"window of {LONGEST - 1}"),
    "low-pass, 100 Hz": _by("low-pass 100 Hz"),
    "low-pass, 20 Hz": _by("low-pass 20 Hz"),
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
    motion["z"], motion["v"], motion["contact_phase"] = HEIGHT_M + phase * SPEED * T, -SPEED, exact.ABOVE
    ticks = int(2.0 * HEIGHT_M / SPEED / T)
    seen = onward(law, motion, ticks * T, ticks * FINE + 1)
    return seen.t_s, seen.z_m, seen.v_m_per_s


def late(estimate: Callable[[Samples], Samples]) -> tuple[float, float]:
    """Lateness of the estimate during a blow, s (the delay that explains it best), and its rms error then, m/s."""
    delays = np.arange(0.0, MAX_LAG_S, T / FINE)
    off, errors = np.zeros(len(delays)), []
    for i in range(PHASES):
        t, z, v = blow(i / PHASES)
        estimated_speeds = estimate(counted(z[::FINE]))
        ticks = t[::FINE]
        inside = np.flatnonzero(z[::FINE] < 0.0)
        met = slice(inside[0], inside[-1] + 1)
        errors.append(estimated_speeds[met] - v[::FINE][met])
        off += [
            np.mean((estimated_speeds[met] - np.interp(ticks[met] - delay, t, v)) ** 2) for delay in delays
        ]
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
        "period_s": T,
        "count_m": COUNT_M,
        "noise_counts": NOISE_COUNTS,
        "speed_m_per_s": SPEED,
        "contact_s": float(np.count_nonzero(z < 0.0) * (t[1] - t[0])),
        "rows": rows,
    }
    stored.store("velocity_estimate", result)


if __name__ == "__main__":
    main()
