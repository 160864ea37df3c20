"""Installed packages that give effects and devices: found by name only, and a broken one harms nobody else."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import drumstick as ds
from drumstick import packages
from drumstick.stick.effects.registry import EFFECTS
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.device.selection import chosen

ROOT = Path(__file__).resolve().parents[3]
TEMPLATE = ROOT / "docs" / "template" / "my_drum.py"
ROLL = ds.scene("roll")


def install(folder: Path, package: str, module: str, effects: str = "", devices: str = "") -> None:
    """A package as an installer leaves it: its module, and the entry points that it declares."""
    (folder / f"{package.replace('-', '_')}.py").write_text(module, encoding="utf-8")
    facts = folder / f"{package.replace('-', '_')}-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1\n", encoding="utf-8")
    entries = f"[drumstick.effects]\n{effects}\n[drumstick.devices]\n{devices}\n"
    (facts / "entry_points.txt").write_text(entries, encoding="utf-8")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three packages that are broken each in its way, and two that give one name."""
    install(
        tmp_path,
        "no-import",
        "import a_module_that_is_nowhere",
        "lost = no_import:LOST",
        "lost = no_import:LOST",
    )
    install(tmp_path, "ends-all", "raise SystemExit(3)", "ending = ends_all:E")
    install(tmp_path, "no-effect", "THING = 3\n", "thing = no_effect:THING\nnothing = no_effect:MISSING")
    for package in ("twin-one", "twin-two"):
        install(
            tmp_path,
            package,
            "",
            f"twin = {package.replace('-', '_')}:T",
            f"twin = {package.replace('-', '_')}:T",
        )
    install(
        tmp_path,
        "renamed",
        TEMPLATE.read_text(encoding="utf-8"),
        "other = renamed:STICKY\npulse = renamed:STICKY",
    )
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "lost",
            "package no-import (no_import:LOST) cannot be used: ModuleNotFoundError: No module named 'a_module",
        ),
        ("ending", "package ends-all (ends_all:E) cannot be used: SystemExit: 3"),
        ("thing", "package no-effect (no_effect:THING) gives a int, where a ds.Effect is wanted"),
        ("nothing", "package no-effect (no_effect:MISSING) cannot be used: AttributeError"),
        ("twin", "2 installed packages give a twin: twin-one, twin-two; uninstall all but one"),
        ("other", 'wire = "sticky.force" must begin with the name of the effect: other.'),
        ("unheard", "unknown effect; known: pulse, "),
    ],
)
def test_a_scene_that_names_one_says_what_is_wrong_with_it_at_its_line(name: str, words: str) -> None:
    with pytest.raises(ds.SceneError) as told:
        ds.scene(f"[stick]\n[effects.pulse]\n[effects.{name}]\n")
    (mistake,) = told.value.mistakes
    assert mistake.startswith(f"scene:3: effects.{name}: ")
    assert words in mistake


@pytest.mark.usefixtures("installed")
def test_no_other_scene_is_harmed_and_the_instruments_own_effect_keeps_its_name() -> None:
    before = list(EFFECTS)
    assert ds.scene("roll") == ROLL
    assert list(EFFECTS) == before


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lost", "package no-import .* cannot be used: ModuleNotFoundError"),
        ("twin", "2 installed packages give a twin"),
        ("unheard", "no device 'unheard'; there is simulated, pointer, openhaptics"),
    ],
)
def test_a_device_that_is_broken_says_so(name: str, words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        chosen(name, ROLL)


def test_nothing_is_looked_up_while_every_name_is_the_instruments_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def looked_up(*_: str) -> Any:
        raise AssertionError("looked up")

    monkeypatch.setattr(packages, "entry_of", looked_up)
    for name in ds.scene_names():
        ds.scene(name)
    chosen("simulated", ROLL)


EDITS = """
import json, sys
sys.path.insert(0, sys.argv[1])
import drumstick as ds
from drumstick.safety import envelope
from drumstick.stick.law import law_of
scene = ds.scene("[stick]\\n[effects.sticky]\\n")
try:
    envelope.require(law_of(scene), envelope.Limits.of(scene))
    refusal = ""
except ds.OutOfEnvelope as error:
    refusal = str(error)
first = ds.simulate(scene, 0.3).contacts["v_out_m_per_s"][0]
print(json.dumps([first, refusal, ds.values(scene)["sticky.force"]]))
"""


def played(folder: Path) -> tuple[float, str, float]:
    done = subprocess.run(
        [sys.executable, "-c", EDITS, str(folder)], capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr[-2000:]
    first, refusal, value = json.loads(done.stdout)
    return first, refusal, value


@pytest.mark.long
def test_an_edited_package_plays_its_new_text_and_without_a_bound_no_device_plays_it(tmp_path: Path) -> None:
    text = TEMPLATE.read_text(encoding="utf-8")
    install(tmp_path, "my-drum", text, "sticky = my_drum:STICKY")
    before, accepted, value = played(tmp_path)
    assert (accepted, value) == ("", 0.2)
    edited = text.replace("return -own.force", "return 2.0 * own.force").replace(
        "force, max_force,", "force,"
    )
    (tmp_path / "my_drum.py").write_text(edited, encoding="utf-8")
    after, refusal, _ = played(tmp_path)
    assert after != before
    assert "the effect sticky does not say how large its force can be" in refusal
    assert refusal.endswith("give its ds.Effect a max_force")
