"""An effect is one module and one line: outside its folder nobody names it, but for those that are known."""

import ast
from collections import defaultdict
from pathlib import Path
from types import ModuleType

import pytest

from drumstick.drum.effects import registry as drum_registry
from drumstick.stick.effects import registry as stick_registry

ROOT = Path(__file__).resolve().parents[2]

# Who names an effect, and which: what the effect is about lies there, not what effects have in common.
KNOWN = {
    "drum": {
        # Solved together with each push of the same step, on mesh and modes; its cents are found by playing the drum.
        "shared/drumstick/drum/calibrate.py": {"tension"},
        "shared/drumstick/drum/mallets/in_touch.py": {"tension"},
        "shared/drumstick/drum/mallets/on_modes.py": {"tension"},
        "shared/drumstick/drum/mallets/under_tension.py": {"tension"},
        "shared/drumstick/drum/modal/apart.py": {"tension"},
        "shared/drumstick/drum/modal/stretch.py": {"tension"},
        # The acoustics that these two tables are for.
        "shared/drumstick/drum/modal/air_load.py": {"air", "kettle"},
        # A controller of MIDI sets it.
        "services/haptic_server/gateway/midi/note_map.py": {"muffle"},
    },
    "stick": {
        # The return map's state is what pulses still have to give; an effect with another memory says NEVER_REPEATS.
        "shared/drumstick/analysis/cycles/basins.py": {"pulse", "cor_pulse"},
        "shared/drumstick/analysis/cycles/cycle.py": {"pulse", "cor_pulse"},
        "shared/drumstick/analysis/cycles/return_step.py": {"pulse", "cor_pulse"},
        "shared/drumstick/analysis/cycles/multiplier.py": {"pulse", "cor_pulse"},
        "shared/drumstick/analysis/cycles/return_map.py": {"pulse", "cor_pulse"},
        # Equations (7) and (8) and the gain are about these pulses, and so are their figures and words.
        "shared/drumstick/analysis/effective.py": {"cor_pulse"},
        "shared/drumstick/analysis/gain.py": {"pulse"},
        "shared/drumstick/analysis/predictions.py": {"pulse", "cor_pulse"},
        "shared/drumstick/analysis/speeds.py": {"pulse"},
        # A roll of a wanted rate and level is found by dv_pls.
        "shared/drumstick/analysis/inverse.py": {"pulse"},
        "shared/drumstick/analysis/unpulsed.py": {"pulse"},
        "services/rig/figures/heading.py": {"pulse", "cor_pulse"},
        "services/rig/figures/predictions.py": {"pulse"},
        "services/rig/figures/write.py": {"pulse"},
        "services/rig/offline/analyse.py": {"pulse", "cor_pulse"},
        # What an uneven hand varies.
        "shared/drumstick/scenes/hand_tables.py": {"pulse"},
        "shared/drumstick/stick/human/unevenness.py": {"pulse"},
        # Its gamma may be over a beta that the stick must have.
        "shared/drumstick/scenes/stick_tables.py": {"cor_pulse"},
        # The fastest entry that stays is among those that it makes faster.
        "shared/drumstick/analysis/rebound.py": {"negative_damping"},
    },
}


def last_name(node: ast.expr) -> str:
    """`b` of `a.b`, and of `b`."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def named_in(text: str, part: str, names: set[str]) -> set[str]:
    """The effects that a module imports, looks up by a key, or compiles for."""
    folder, found, tree = f"drumstick.{part}.effects", set[str](), ast.parse(text)
    keys = {id(key) for node in ast.walk(tree) if isinstance(node, ast.Dict) for key in node.keys}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == folder:
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{folder}."):
            found.add((node.module or "").rpartition(".")[2])
        elif isinstance(node, ast.Attribute) and last_name(node.value) in ("effects", "law", "motion"):
            found.add(node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in keys:
            found.add(node.value)
    return found & names


@pytest.mark.parametrize(("part", "registry"), [("drum", drum_registry), ("stick", stick_registry)])
def test_nobody_outside_names_an_effect_but_those_that_are_known(part: str, registry: ModuleType) -> None:
    names: set[str] = set(registry.EFFECTS)
    found: dict[str, set[str]] = defaultdict(set)
    for top in ("shared", "services"):
        for path in (ROOT / top).rglob("*.py"):
            where = path.relative_to(ROOT).as_posix()
            if not where.startswith(f"shared/drumstick/{part}/effects/"):
                found[where] |= named_in(path.read_text(encoding="utf-8"), part, names)
    assert {where: those for where, those in found.items() if those} == KNOWN[part]


@pytest.mark.parametrize(
    "text",
    [
        "from drumstick.drum.effects import rim\n",
        "from drumstick.drum.effects.rim import RimTable\n",
        "def f(engine): return engine.effects.rim.state[0]\n",
        "def f(drum): return drum.effects['rim']\n",
        "@only_with('rim')\ndef f(engine): ...\n",
    ],
)
def test_an_effect_is_found_however_it_is_named(text: str) -> None:
    assert named_in(text, "drum", {"rim", "tension"}) == {"rim"}
    assert named_in('"""The rim of the head."""\n', "drum", {"rim"}) == set()
