"""Cost and result of the effects: of the drum a sample, of the stick a tick; and the cost of composing."""

import statistics
from collections.abc import Iterator
from typing import Any

from drumstick.drum.effects.registry import MESH_EFFECTS
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick_lab.accuracy.drums import drum_effects
from drumstick_lab.accuracy.drums.by_hand import Race
from drumstick_lab.accuracy.job import Job
from drumstick_lab.accuracy.sticks import stick_effects
from drumstick_lab.accuracy.timing import CHAIN, SWEEP

_ROUNDS, _QUICK_ROUNDS = 40, 12


def _none(rounds: int) -> dict[str, float]:
    # ns of a step of the default drum, told for each of the device's samples that it lasts; and the median of the
    # rounds' own ratios, to which a neighbour on the processor does least.
    race = Race(drum_effects.drum_with())
    times = race.run(rounds)
    divisor = int(race.engine.control["divisor"][0])
    return {
        "ns_per_sample": min(composed for composed, _ in times) / divisor,
        "by_hand_ns": min(hand for _, hand in times) / divisor,
        "over_by_hand": statistics.median(composed / hand for composed, hand in times),
    }


def jobs(quick: bool, found: dict[str, Any]) -> Iterator[Job]:
    """Notes sample, tick, none and yardstick_ns. Seconds with warm kernels; others take seconds each to compile.

    Quick leaves out effects whose kernels no shipped scene has and that would compile for long.
    """
    rounds = _QUICK_ROUNDS if quick else _ROUNDS
    found["yardstick_ns"] = {}
    sample, tick = (
        (drum_effects.QUICK, stick_effects.QUICK) if quick else (tuple(MESH_EFFECTS), tuple(STICK_TABLES))
    )

    def of_samples() -> None:
        found["sample"], found["yardstick_ns"][SWEEP] = drum_effects.sample_rows(sample, rounds)

    def of_ticks() -> None:
        found["tick"], found["yardstick_ns"][CHAIN] = stick_effects.tick_rows(tick, rounds)

    def of_none() -> None:
        found["none"] = _none(rounds)

    yield Job("a drum without effects, composed and by hand", of_none)
    yield Job("effects of the drum", of_samples)
    yield Job("effects of the stick", of_ticks)
