"""Cost of effects per step: drumstick lab step-cost [--rounds 60].

The composed kernels against loops written by hand (tests/plain_steps.py) for scenes with 0, 1 and 3 effects: the same
steps of semi-implicit Euler without event location, the same result to the last bit. And every effect alone, on the
same stick, against none. CPU time of the thread, windows in turn, the best of each.
"""

import argparse
import dataclasses
from typing import Any

import plain_steps
import steps
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.law import law_type, motion_type
from drumstick_lab.measuring import stored


def races(rounds: int) -> dict[str, Any]:
    rows: dict[str, Any] = {}
    for count, race in steps.RACES.items():
        plain, composed = [], []
        for _ in range(rounds):
            plain.append(steps.plain_window(race.plain))
            composed.append(steps.composed_window(race.scene))
        z, v, blow = race.plain(steps.STEPS)
        motion = race.composed(steps.STEPS)
        ours = [float(motion[name][0]) for name in ("z", "v", *plain_steps.Blow._fields)]
        rows[str(count)] = {
            "words": race.words,
            "plain_ns": min(plain) * 1e9,
            "composed_ns": min(composed) * 1e9,
            "ratio": min(composed) / min(plain),
            "bit_equal": ours == [z, v, *blow],
        }
        print(rows[str(count)])
    return rows


def alone(rounds: int) -> dict[str, Any]:
    """Each effect on the undamped stick of the first race, which never comes to rest, against that stick without."""
    bare = steps.RACES[0].scene
    rows: dict[str, Any] = {}
    for name, table in STICK_TABLES.items():
        scene = dataclasses.replace(bare, effects={name: _small(name, table)})
        without, with_it = [], []
        for _ in range(rounds):
            without.append(steps.composed_window(bare))
            with_it.append(steps.composed_window(scene))
        rows[name] = {
            "without_ns": min(without) * 1e9,
            "with_ns": min(with_it) * 1e9,
            "law_bytes": law_type((name,)).itemsize - law_type(()).itemsize,
            "motion_bytes": motion_type((name,)).itemsize - motion_type(()).itemsize,
        }
        print(name, rows[name])
    return rows


# Weak enough that the undamped stick plays on for the whole window.
_WEAK: dict[str, dict[str, float]] = {
    "pulse": {"dv_m_per_s": 1e-3},
    "cor_pulse": {"gamma": 1e-3},
    "system_delay": {"period_s": 1e-3, "delay_ticks": 1},
    "hysteretic_spring": {"ratio": 1.001},
    "negative_damping": {"r_N_s_per_m": 1e-3, "below_m_per_s": 10.0},
    "noise": {"force_N": 1e-3, "hold_s": 1e-3},
    "chaos": {"force_N": 1e-3},
}


def _small(name: str, table: type) -> Any:
    return table(**_WEAK[name])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=60)
    rounds = parser.parse_args().rounds
    result = {
        "rounds": rounds,
        "dt_s": steps.DT_S,
        "steps": steps.STEPS,
        "races": races(rounds),
        "alone": alone(rounds),
    }
    stored.store("step_cost", result)


if __name__ == "__main__":
    main()
