"""The compile cache: shared, never stale, and never the reason why something does not start."""

import io
import json
import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from kernel_program import answer_of

ROOT = Path(__file__).resolve().parents[4]
# One kernel and one C callback, compiled and called; prints the folder, their results and how often the cache was hit.
PROGRAM = """
import ctypes, json, warnings
warnings.simplefilter("always")
from drumstick.stick import contact
from realtime.kernels import store
from realtime.kernels import jit

@jit.cfunction("float64(float64)")
def twice(x):
    return 2.0 * x

value = contact.beta_eq3(0.015, 5000.0, 1.3)
called = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(twice.address)(21.0)
hits = sum(contact.beta_eq3.stats.cache_hits.values())
folder = store.folder_of("drumstick.stick.contact")
print(json.dumps([None if folder is None else str(folder), value, called, hits]))
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


def test_where_all_is_stored_numba_does_not_get_ready_to_compile(tmp_path: Path) -> None:
    program = "import sys; from drumstick.stick import contact; contact.beta_eq3(0.015, 5000.0, 1.3); "
    program += "print(json.dumps('numba.cpython.listobj' in sys.modules))"
    ready = [answer_of(f"import json; {program}", tmp_path) for _ in range(2)]
    assert ready == [True, False]


@pytest.mark.parametrize("damage", ["truncated", "emptied", "garbage"])
@pytest.mark.long
def test_damaged_files_are_compiled_over(tmp_path: Path, damage: str) -> None:
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is not None
    files = [path for path in Path(folder).parent.rglob("*.nb*") if path.is_file()]
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


@pytest.mark.long
def test_a_list_that_names_types_of_another_release_is_begun_anew(tmp_path: Path) -> None:
    """Such a list cannot be read: its module is gone. What is compiled now is stored all the same."""
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is not None
    for index in Path(folder).rglob("*.nbi"):
        version, at = index.read_bytes(), io.BytesIO(index.read_bytes())
        pickle.load(at)
        index.write_bytes(version[: at.tell()] + b"cno_such_module\nHead\n.")
    _, hits, said = _run(tmp_path / "cache", tmp_path / "program.py")
    assert hits == 0
    assert said == ""
    _, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert hits == 1


@pytest.mark.long
def test_a_folder_in_whose_place_a_file_stands(tmp_path: Path) -> None:
    """No folder can be made: everything compiles, without a cache."""
    (tmp_path / "cache").write_text("not a folder", encoding="utf-8")
    folder, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is None
    assert hits == 0


@pytest.mark.long
def test_a_read_only_folder(tmp_path: Path) -> None:
    """/proc takes no files, from root neither; a read-only installation looks the same."""
    folder, hits, _ = _run(Path("/proc"), tmp_path / "program.py")
    assert folder is None
    assert hits == 0


def _copied(to: Path) -> Path:
    for part in ("shared", "services"):
        shutil.copytree(ROOT / part, to / part, ignore=shutil.ignore_patterns("__pycache__"))
    return to


@pytest.mark.long
def test_the_same_sources_elsewhere_compile_nothing(tmp_path: Path) -> None:
    """As an installed release does, beside the one before it."""
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    there, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", _copied(tmp_path / "copy"))
    assert (there, hits) == (folder, 1)


@pytest.mark.long
def test_a_changed_source_gets_another_folder(tmp_path: Path) -> None:
    """An edit in any file that the kernel's own imports, however far, leaves the old code behind; others do not."""
    copy = _copied(tmp_path / "copy")
    first, _, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    for untouched in ("drumstick/analysis/gain.py", "drumstick/parameters/stick.py"):
        _edit(copy / "shared" / untouched)
        same, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
        assert (same, hits) == (first, 1)
    _edit(
        copy / "shared" / "realtime" / "kernels" / "float_mode.py"
    )  # contact, jit, store: none of them names it
    same, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    assert (same, hits) == (first, 1)
    _edit(copy / "shared" / "realtime" / "kernels" / "store.py")  # by way of jit
    second, hits, _ = _run(tmp_path / "cache", tmp_path / "program.py", copy)
    assert second != first
    assert hits == 0


def _edit(path: Path) -> None:
    path.write_text(path.read_text(encoding="utf-8") + "\n# a change\n", encoding="utf-8")


@pytest.mark.long
def test_what_python_imports_is_what_the_hash_covers() -> None:
    """Judged by Python itself: each module of ours that importing a kernel's module loads is in its hash."""
    program = """
import importlib, json, sys
from realtime.kernels import store

before = set(sys.modules)
importlib.import_module(sys.argv[1])
loaded = {name for name in set(sys.modules) - before if name.split(".")[0] in store.KERNEL_PACKAGES}
seen, left = {sys.argv[1]}, [sys.argv[1]]
while left:
    new = store._imports(left.pop()) - seen
    seen |= new
    left += new
print(json.dumps(sorted(loaded - seen)))
"""
    path = os.pathsep.join(str(ROOT / part) for part in ("shared", "services"))
    for module in (
        "drumstick.stick.motion.exact",
        "haptic_server.servo.force.tick",
        "drumstick.drum.render",
        "drumstick.safety.envelope",
    ):
        done = subprocess.run(
            [sys.executable, "-c", program, module], env=dict(os.environ, PYTHONPATH=path), capture_output=True,
            text=True, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


@pytest.mark.long
def test_old_folders_are_cleared_away(tmp_path: Path) -> None:
    root = tmp_path / "cache" / "haptic-drumstick" / "kernels"
    for age in range(10):
        for module in ("drumstick.stick.contact", "drumstick.stick.contact_ahead"):
            old = root / f"{module}-{age:016d}"
            old.mkdir(parents=True)
            os.utime(old, (1000 + age, 1000 + age))
    folder, _, _ = _run(tmp_path / "cache", tmp_path / "program.py")
    assert folder is not None
    left = {path.name for path in root.glob("drumstick.stick.contact-*")}
    assert len(left) == 4
    assert {Path(folder).name, f"drumstick.stick.contact-{9:016d}"} <= left
    assert len(list(root.glob("drumstick.stick.contact_ahead-*"))) == 10


# The program says each step that it was given to stand before, and goes on with the next line of its standard input.
STEPS = """
import sys, warnings
warnings.simplefilter("ignore")
from realtime.kernels import store
from realtime.kernels import jit
import kernels

def stand(owner, name):
    real = getattr(owner, name)
    def standing(*given):
        print(name, flush=True)
        sys.stdin.readline()
        return real(*given)
    setattr(owner, name, standing)

number, patience_s, *steps = sys.argv[1:]
store._PATIENCE_S = float(patience_s)
file = kernels.doubled._cache._inner._cache_file
owners = {"compile": kernels.doubled._compiler, "sleep": store.time}
for step in steps:
    stand(owners.get(step, file), step)
print(kernels.doubled(eval(number)), flush=True)
print(sum(kernels.doubled.stats.cache_hits.values()), flush=True)
"""
KERNELS = """
from realtime.kernels import jit

@jit.njit()
def doubled(x):
    return x + x
"""


class Process:
    """A process that compiles a kernel, step by step."""

    def __init__(self, folder: Path, number: str, *steps: str, patience_s: float = 60.0) -> None:
        (folder / "kernels.py").write_text(KERNELS, encoding="utf-8")
        path = os.pathsep.join((str(folder), *(str(ROOT / part) for part in ("shared", "services"))))
        self.process = subprocess.Popen(
            [sys.executable, "-c", STEPS, number, str(patience_s), *steps],
            env=dict(os.environ, XDG_CACHE_HOME=str(folder), PYTHONPATH=path),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def says(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def go_on(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Process]]:
    started: list[Process] = []

    def begin(*words: str, **options: float) -> Process:
        started.append(Process(tmp_path, *words, **options))
        return started[-1]

    yield begin
    for each in started:
        each.close()


@pytest.mark.long
def test_one_process_compiles_and_the_other_waits_for_it(start: Callable[..., Process]) -> None:
    first = start("21", "compile")
    assert first.says() == "compile"
    second = start("21", "sleep")
    assert second.says() == "sleep"
    first.go_on()
    assert [first.says(), first.says()] == ["42", "0"]
    second.go_on()
    assert [second.says(), second.says()] == ["42", "1"]


@pytest.mark.long
def test_who_was_stopped_while_compiling_is_waited_for_no_longer_than_a_minute(
    start: Callable[..., Process],
) -> None:
    first = start("21", "compile")
    assert first.says() == "compile"
    second = start("21", patience_s=0.1)
    assert [second.says(), second.says()] == ["42", "0"]


@pytest.mark.long
def test_two_that_save_at_once_never_share_a_file(start: Callable[..., Process]) -> None:
    """Each has read the list before the other writes it; one's line is written last, and the other's code."""
    whole = start("21", "_save_index", "_save_data")
    assert whole.says() == "_save_index"
    real = start("1.5", "_save_index", patience_s=0.1)  # as where the file system has no locks
    assert real.says() == "_save_index"
    whole.go_on()
    assert whole.says() == "_save_data"
    real.go_on()
    assert [real.says(), real.says()] == ["3.0", "0"]
    whole.go_on()
    assert [whole.says(), whole.says()] == ["42", "0"]
    third = start("1.5")
    assert [third.says(), third.says()] == ["3.0", "1"]
    assert start("21").says() == "42"


# How fast a roll with each of these effects can get: kernels too long to be copied into their caller.
SPEEDS = """
import json, sys
from drumstick.safety import bounds
from drumstick.stick.law import law_of
from drumstick.parameters.scene import Scene
from drumstick.stick.effects.registry import STICK_TABLES

print(json.dumps([
    bounds.bounds_of_contact(law_of(Scene(name, effects={name: STICK_TABLES[name]()}))[0])
    for name in sys.argv[1:]
]))
"""


@pytest.mark.long
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
