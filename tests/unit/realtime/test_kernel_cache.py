"""The compile cache: shared, never stale, and never the reason why something does not start."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
# One kernel and one C callback, compiled and called; prints the folder, their results and how often the cache was hit.
PROGRAM = """
import ctypes, json, warnings
warnings.simplefilter("always")
from drumstick import contact
from realtime import jit

@jit.cfunction("float64(float64)")
def twice(x):
    return 2.0 * x

value = contact.beta_eq3(0.015, 5000.0, 1.3)
called = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(twice.address)(21.0)
hits = sum(contact.beta_eq3.stats.cache_hits.values())
folder = None if jit.CACHE_FOLDER is None else str(jit.CACHE_FOLDER)
print(json.dumps([folder, value, called, hits]))
"""
EXPECTED_BETA = 0.78941675618  # exp(-R pi / sqrt(4 m K - R^2)) of set A


def _run(cache: Path, program: Path, packages: Path = ROOT) -> tuple[str | None, int, str]:
    program.write_text(PROGRAM, encoding="utf-8")
    path = os.pathsep.join(str(packages / part) for part in ("shared", "services"))
    environment = dict(os.environ, XDG_CACHE_HOME=str(cache), PYTHONPATH=path)
    done = subprocess.run(
        [sys.executable, program], env=environment, capture_output=True, text=True, check=False, timeout=110
    )
    assert done.returncode == 0, done.stderr
    folder, value, called, hits = json.loads(done.stdout)
    assert value == pytest.approx(EXPECTED_BETA, rel=1e-9)
    assert called == 42.0
    return folder, hits, done.stderr


def test_the_second_start_compiles_nothing(tmp_path: Path) -> None:
    folder, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert hits == 0
    again, hits, said = _run(tmp_path / "cache", tmp_path / "program.py")
    assert again == folder
    assert hits == 1
    assert said == ""


@pytest.mark.parametrize("damage", ["truncated", "emptied", "garbage"])
def test_damaged_files_are_compiled_over(tmp_path: Path, damage: str) -> None:
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is not None
    files = [path for path in Path(folder).rglob("*.nb*") if path.is_file()]
    assert len(files) >= 4
    for path in files:
        content = path.read_bytes()
        damaged = {
            "truncated": content[: len(content) // 2],
            "emptied": b"",
            "garbage": b"\x93" * len(content),
        }
        path.write_bytes(damaged[damage])
    _, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert hits == 0


def test_a_folder_in_whose_place_a_file_stands(tmp_path: Path) -> None:
    """No folder can be made: everything compiles, without a cache."""
    (tmp_path / "cache").write_text("not a folder", encoding="utf-8")
    folder, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is None
    assert hits == 0


def test_a_read_only_folder(tmp_path: Path) -> None:
    """/proc takes no files, from root neither; a read-only installation looks the same."""
    folder, hits, _ = _run(Path("/proc"), tmp_path / "program.py")
    assert folder is None
    assert hits == 0


def _copied(to: Path) -> Path:
    for part in ("shared", "services"):
        shutil.copytree(ROOT / part, to / part, ignore=shutil.ignore_patterns("__pycache__"))
    return to


def test_the_same_sources_elsewhere_compile_nothing(tmp_path: Path) -> None:
    """As an installed release does, beside the one before it."""
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    there, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", _copied(tmp_path / "copy"))
    assert (there, hits) == (folder, 1)


def test_a_changed_source_gets_another_folder(tmp_path: Path) -> None:
    """An edit in any kernel's file, also in one that the running kernel only calls, leaves the old code behind."""
    copy = _copied(tmp_path / "copy")
    first, _, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    same, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    assert (same, hits) == (first, 1)
    edited = copy / "shared" / "drumstick" / "segment.py"
    edited.write_text(edited.read_text(encoding="utf-8") + "\n# a change\n", encoding="utf-8")
    second, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    assert second != first
    assert hits == 0


def test_old_folders_are_cleared_away(tmp_path: Path) -> None:
    root = tmp_path / "cache" / "haptic-drumstick"
    for age in range(10):
        old = root / f"kernels-{age:016d}"
        old.mkdir(parents=True)
        os.utime(old, (1000 + age, 1000 + age))
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    left = {path.name for path in root.iterdir()}
    assert folder is not None
    assert len(left) == 4
    assert {Path(folder).name, f"kernels-{9:016d}"} <= left


# How fast a roll with each of these effects can get: kernels too long to be copied into their caller.
SPEEDS = """
import json, sys
from drumstick import bounds
from drumstick.law import law_of
from drumstick.scene import EFFECTS, Scene

print(json.dumps([
    bounds.blows_of(law_of(Scene(name, effects={name: EFFECTS[name]()}))[0]) for name in sys.argv[1:]
]))
"""


def test_kernels_that_two_processes_compiled_for_two_scenes_stay_apart_in_a_third(tmp_path: Path) -> None:
    """Equal symbols in both would make the third run the one's code on the other's memory."""
    path = os.pathsep.join(str(ROOT / part) for part in ("shared", "services"))
    environment = dict(os.environ, XDG_CACHE_HOME=str(tmp_path), PYTHONPATH=path)

    def speeds(*effects: str) -> list[float]:
        done = subprocess.run(
            [sys.executable, "-c", SPEEDS, *effects],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return json.loads(done.stdout)

    (chaos,), (spring,) = speeds("chaos"), speeds("hysteretic_spring")
    assert chaos != spring
    assert speeds("hysteretic_spring", "chaos") == [spring, chaos]
    assert speeds("chaos", "hysteretic_spring") == [chaos, spring]
