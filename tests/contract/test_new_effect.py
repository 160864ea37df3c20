"""An effect of the stick that somebody adds: one module and one line, and it plays, is bounded, shown and described.

The effect is a constant force by which the head pulls the stick down. Of a contact without damping and without a hand
the answer is known: m z'' = -K z - F from z = 0 at -u to z = 0 again gives the speed back, and takes
(pi + 2 atan(F w/(K u)))/w with w^2 = K/m.
"""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULE = '''
"""A head that pulls: a constant force downwards in contact. Kernels: tick thread; no allocation."""

from dataclasses import dataclass
from typing import Any

from drumstick.parameters.declare import number
from realtime.kernels.jit import only_with
from realtime.records import Record


@dataclass(frozen=True)
class Stickiness:
    """`[effects.stickiness]`."""

    force_N: float = number(1.0, 0.0, 50.0, "N", "Force by which the head holds the stick", wire="stickiness.force")


class StickinessLaw(Record):
    """The same in compiled code."""

    force: float


class Nothing(Record):
    """It remembers nothing."""


TABLE = Stickiness
LAW, STATE = StickinessLaw, Nothing
STRENGTH = "stickiness.force"
ALTERS_HEAD = True


@only_with("stickiness", otherwise=0.0)
def force(law: Any) -> float:
    """The force now, N."""
    return -law.stickiness.force


@only_with("stickiness", otherwise=0.0)
def max_force(law: Any) -> float:
    """The largest force, N."""
    return law.stickiness.force


@only_with("stickiness", otherwise=True)
def usable(law: Any) -> bool:
    """Is its number fit for a device?"""
    return 0.0 <= law.stickiness.force < 1e6
'''
PLAYS = """
import json
from drumstick.parameters.scene import parse, shipped_text
from drumstick.parameters.table import Refusal, table_of, with_changes
from drumstick.safety.envelope import Limits, require
from drumstick.stick.cost import tick_cost
from drumstick.stick.law import law_of
from drumstick.stick.simulate import COLUMNS, simulate
from drumstick_lab.pages.scenes_page import page
from protocol.osc import param

bare = parse('''
[stick]
m_kg = 0.015
k_coll_N_per_m = 5000.0
r_in_N_s_per_m = 0.0
r_out_N_s_per_m = 0.0
k_hand_N_per_m = 0.0
release = "paper"
[effects.stickiness]
force_N = 3.0
''', "bare")
roll = parse(shipped_text("roll") + "\\n[effects.stickiness]\\nforce_N = 0.2\\n", "roll")
table, limits = table_of(roll), Limits.of(roll)


def refusal(force_N):
    try:
        require(with_changes(law_of(roll), table, {"stickiness.force": force_N}), limits)
    except Refusal as error:
        return str(error)
    return ""


quantity = table["stickiness.force"].quantity
print(json.dumps({
    "contact": dict(zip(COLUMNS, simulate(bare, 1.0, -0.4).contacts[0].tolist())),
    "contacts": len(simulate(roll, 1.0).contacts),
    "range": [quantity.low, quantity.high, quantity.unit],
    "address": param("/drumstick", "stickiness.force", 1.0).split(b"\\0")[0].decode(),
    "refusals": [refusal(0.2), refusal(50.0)],
    "docs": [line for line in page().splitlines() if "tickiness" in line or "holds the stick" in line],
    "tick_ns": tick_cost(roll, 2000).ns,
}))
"""


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a copy of the library does that has the effect."""
    shared = tmp_path_factory.mktemp("tree") / "shared"
    shutil.copytree(ROOT / "shared", shared, ignore=shutil.ignore_patterns("__pycache__"))
    effects = shared / "drumstick" / "stick" / "effects"
    (effects / "stickiness.py").write_text(MODULE.lstrip(), encoding="utf-8")
    registry = (effects / "registry.py").read_text(encoding="utf-8")
    last = "    chaos,\n)\n"
    assert registry.count(last) == 1
    (effects / "registry.py").write_text(
        registry.replace(last, "    chaos,\n    stickiness,\n)\n").replace(
            "    pulse,\n    system_delay,\n)", "    pulse,\n    stickiness,\n    system_delay,\n)"
        ),
        encoding="utf-8",
    )
    path = os.pathsep.join(map(str, (shared, ROOT / "services", ROOT / "lab")))
    done = subprocess.run(
        [sys.executable, "-c", PLAYS], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


@pytest.mark.long
def test_it_plays_and_its_contact_is_the_one_in_closed_form(played: dict[str, Any]) -> None:
    m, k, pull, u = 0.015, 5000.0, 3.0, 0.4
    w = math.sqrt(k / m)
    contact = played["contact"]
    assert contact["v_out_m_per_s"] == pytest.approx(u, rel=1e-12)
    lasts = (math.pi + 2.0 * math.atan(pull * w / (k * u))) / w
    assert contact["t_out_s"] - contact["t_in_s"] == pytest.approx(lasts, rel=1e-11)
    assert played["contacts"] > 5


@pytest.mark.long
def test_it_is_bounded_by_what_it_says_that_it_adds(played: dict[str, Any]) -> None:
    weak, strong = played["refusals"]
    assert weak == ""
    assert "lower dv_pls and stickiness.force" in strong


@pytest.mark.long
def test_the_wire_the_panel_and_the_page_follow_from_its_table(played: dict[str, Any]) -> None:
    assert played["range"] == [0.0, 50.0, "N"]
    assert played["address"] == "/drumstick/param/stickiness.force"
    heading, *rows = played["docs"]
    assert heading == "### `[effects.stickiness]`"
    assert any("force_N" in row and "Force by which the head holds the stick" in row for row in rows)
    assert played["tick_ns"] > 0.0
