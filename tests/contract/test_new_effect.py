"""An effect that somebody adds: one module and one line, and it plays, is bounded, shown and described.

The stick's effect is a constant force by which the head pulls the stick down. Of a contact without damping and without
a hand the answer is known: m z'' = -K z - F from z = 0 at -u to z = 0 again gives the speed back, and takes
(pi + 2 atan(F w/(K u)))/w with w^2 = K/m.
"""

import json
import math
import os
import re
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
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal, table_of, with_changes
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


def with_effect(tree: Path, part: str, name: str, text: str) -> str:
    """Copy the library into `tree` with a module more among the effects of `part`; the PYTHONPATH to play it with."""
    shared = tree / "shared"
    shutil.copytree(ROOT / "shared", shared, ignore=shutil.ignore_patterns("__pycache__"))
    effects = shared / "drumstick" / part / "effects"
    (effects / f"{name}.py").write_text(text.lstrip(), encoding="utf-8")
    registry = effects / "registry.py"
    before = registry.read_text(encoding="utf-8")
    after = re.sub(r"(_IN_ORDER.*\([^)]*?),?(\s*)\)", rf"\1, {name}\2)", before)
    after = re.sub(
        rf"(from drumstick\.{part}\.effects import )(\(?)",
        rf"from drumstick.{part}.effects import {name}\n\1\2",
        after,
    )
    assert after.count(name) == 2
    registry.write_text(after, encoding="utf-8")
    return os.pathsep.join(map(str, (shared, ROOT / "services", ROOT / "lab")))


def printed(path: str, program: str) -> dict[str, Any]:
    """Output of a program that finds the library there."""
    done = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Play of a copy of the library that has the effect of the stick."""
    return printed(with_effect(tmp_path_factory.mktemp("tree"), "stick", "stickiness", MODULE), PLAYS)


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


HUM = '''
"""A drum that hums: a sine beside the head while it sounds. Kernels: audio thread."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drumstick.parameters.declare import number
from realtime.kernels.jit import only_with
from realtime.records import Record, Rows, dtype_of


@dataclass(frozen=True)
class HumTable:
    """The drum hums."""

    f_Hz: float = number(1000.0, 20.0, 5000.0, "Hz", "Pitch of the hum")
    level: float = number(0.1, 0.0, 1.0, "1", "Level of the hum")


TABLE = HumTable
ON_MODES = True


class HumState(Record):
    """Place, way in a step, and level."""

    phase: float
    turn: float
    level: float


class Hum(NamedTuple):
    """state: (1,)."""

    state: Rows[HumState]


def part_of(building: Any) -> Hum:
    """At the beginning of the sine."""
    table = building.scene.drum.effects["hum"]
    state = np.zeros(1, dtype_of(HumState))
    state["turn"], state["level"] = 2.0 * math.pi * table.f_Hz * building.step_s, table.level
    return Hum(state)


@only_with("hum", otherwise=0.0)
def added_output(engine: Any) -> float:
    """The sine's next value."""
    state = engine.effects.hum.state[0]
    state.phase += state.turn
    return state.level * math.sin(state.phase)
'''
SOUNDS = """
import json
import numpy as np
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.scenes.scene_text import parse
from drumstick_lab.pages.scenes_page import page
from rig.offline import scene_cost

def spectrum(text):
    sound = render(parse(text, "x"), [OfflineStrike(0.0, 0.3, 0.0, 10.0, 0.005)], 1.0, 48000)[:, 0]
    return np.abs(np.fft.rfft(sound * np.hanning(len(sound)))) * 4.0 / len(sound)

HUM = "[drum.effects.hum]\\nf_Hz = 3000.0\\nlevel = 0.2\\n"
found = {}
for name, text in (("mesh", "[drum]\\n"), ("modes", "[modal]\\n")):
    without, with_it = spectrum(text), spectrum(text + HUM)
    found[name] = [float(without[3000]), float(with_it[3000]), int(np.argmax(np.abs(with_it - without)))]
print(json.dumps({
    **found,
    "docs": [line for line in page().splitlines() if "hum" in line],
    "cost": list(scene_cost._drum_effects(parse("[drum]\\n" + HUM, "x"), lambda what: None)),
}))
"""


@pytest.mark.long
def test_a_drums_effect_sounds_on_mesh_and_modes_and_is_described_and_priced(tmp_path: Path) -> None:
    found = printed(with_effect(tmp_path, "drum", "hum", HUM), SOUNDS)
    for renderer in ("mesh", "modes"):
        without, with_it, loudest = found[renderer]
        assert loudest == 3000
        assert with_it > 100.0 * without
    assert any("drum.effects.hum" in line for line in found["docs"])
    assert any("Pitch of the hum" in line for line in found["docs"])
    assert found["cost"] == ["hum"]
