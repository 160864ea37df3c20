"""Cycles of the shipped scenes as they were found once: tests/physics/drumstick/reference/cycles.json.

`python tests/stored_cycles.py` finds them anew, by `drumstick.analyse` of each scene that has one hand, and writes
them: after a change that is meant to move them, and only then.
"""

import json
from pathlib import Path

import drumstick as ds

FILE = Path(__file__).parent / "physics/drumstick/reference/cycles.json"


def cycles_of(name: str) -> list[list[float]]:
    """Exit and entry speed of each cycle, m/s."""
    return [[cycle.v_e_m_per_s, cycle.v_in_m_per_s] for cycle in ds.analyse(ds.scene(name)).cycles]


def names() -> list[str]:
    """Shipped scenes with one hand: two hands play two strokes in turn, which is no cycle of one stick."""
    return [name for name in ds.scene_names() if ds.scene(name).hand.hands == 1]


if __name__ == "__main__":
    rows = [f"  {json.dumps(name)}: {json.dumps(cycles_of(name))}" for name in names()]
    FILE.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")
