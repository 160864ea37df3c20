"""The import contracts bite: each forbidden import, put into a copy of the tree, is refused by lint-imports."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

ONE_WAY = "In every folder imports go one way"
FORBIDDEN = [
    ("shared/drumstick/parameters/stick.py", "import socket", "drumstick does no I/O"),
    ("shared/drumstick/stick/effects/pulse.py", "from pathlib import Path", "drumstick does no I/O"),
    ("shared/drumstick/scenes/scene_text.py", "from protocol import keys", "drumstick imports only realtime"),
    ("shared/realtime/ring.py", "import drumstick.stick.contact", "realtime imports nothing of ours"),
    ("shared/protocol/keys.py", "import realtime.ring", "protocol imports only drumstick"),
    ("services/sound_server/mixer.py", "import haptic_server.block", "Services never import one another"),
    ("shared/drumstick/drum/step.py", "import sound_server.mixer", "drumstick imports only realtime"),
    ("services/web_panel/__init__.py", "import rig", "Nothing imports rig"),
    ("services/rig/folder.py", "import drumstick_lab.checkout", "Nothing imports the laboratory"),
    ("services/rig/replaying/cues.py", "import haptic_server.records", "Recording and replaying meet"),
    ("shared/protocol/access/identity.py", "import cryptography", "Only rig makes and reads certificates"),
    ("shared/drumstick/drum/step.py", "import os", "drumstick does no I/O"),
    ("shared/drumstick/files.py", "import os", "drumstick does no I/O"),
    (
        "shared/drumstick/public/run.py",
        "import haptic_server.servo.offline",
        "drumstick imports only realtime",
    ),
    ("services/haptic_server/servo/force/tick.py", "import haptic_server.servo.loop", ONE_WAY),
    ("services/rig/network/monitor.py", "def late(): import rig.machine.doctor", ONE_WAY),
    ("services/web_panel/rig/answer.py", "if TYPE_CHECKING: import web_panel.whole_page", ONE_WAY),
    ("lab/drumstick_lab/accuracy/timing.py", "from drumstick_lab.benchmarks import worse", ONE_WAY),
]


I_O = {"asyncio", "io", "logging", "os", "pathlib", "select", "shutil", "socket", "subprocess", "tempfile"} | {
    "pythonosc", "rtmidi2", "sounddevice", "viser", "websockets", "zenoh", "zeroconf"
}  # fmt: skip
# Beside their kernels they ask the system for a thread's priority and processor.
THREADS = {
    "haptic_server/servo/device/openhaptics/thread.py",
    "haptic_server/servo/stall_detector.py",
}
# What makes compiled code of a function, around it or called with it; others have an `overload` of their own.
COMPILERS = {"njit", "only_with", "overload", "cfunction", "CFunction", "folded"}
KERNELS = "realtime.kernels"
BEYOND_THE_LIBRARY = {"rig", "haptic_server", "sound_server", "web_panel", "protocol", "drumstick_lab"}


def defines_kernels(tree: ast.Module) -> bool:
    """True when the module has a function compiled, by whatever name it calls the compiler."""
    froms = [
        n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and (n.module or "").startswith(KERNELS)
    ]
    own = {each.asname or each.name for node in froms for each in node.names if each.name in COMPILERS}
    called = (node.func for node in ast.walk(tree) if isinstance(node, ast.Call))
    return any(
        (isinstance(name, ast.Name) and name.id in own)
        or (isinstance(name, ast.Attribute) and name.attr in COMPILERS)
        for name in called
    )


def modules_of(tree: ast.Module) -> set[str]:
    """Whole names of everything that a module imports, wherever it does; `from a import b` may be of a module a.b."""
    nodes = list(ast.walk(tree))
    plain = {a.name for node in nodes if isinstance(node, ast.Import) for a in node.names}
    froms = [node for node in nodes if isinstance(node, ast.ImportFrom)]
    taken = {f"{node.module or ''}.{a.name}" for node in froms for a in node.names}
    return plain | {node.module or "" for node in froms} | taken


def imported(tree: ast.Module) -> set[str]:
    """Their top-level names."""
    return {name.partition(".")[0] for name in modules_of(tree)}


def kernels_with_i_o(services: Path) -> set[str]:
    found: set[str] = set()
    for path in services.rglob("*.py"):
        module = ast.parse(path.read_text(encoding="utf-8"))
        if defines_kernels(module) and imported(module) & I_O:
            found.add(path.relative_to(services).as_posix())
    return found


def test_every_compiler_is_there() -> None:
    kernels = (ROOT / "shared" / "realtime" / "kernels").rglob("*.py")
    modules = [ast.parse(path.read_text(encoding="utf-8")) for path in kernels]
    defined = {
        n.name for module in modules for n in module.body if isinstance(n, ast.FunctionDef | ast.ClassDef)
    }
    assert defined >= COMPILERS


@pytest.mark.parametrize(
    "text",
    [
        "from realtime.kernels.jit import njit\n@njit()\ndef f(x): ...",
        "from realtime.kernels.jit import overload as chosen\n@chosen(g)\ndef f(x): ...",
        "from realtime.kernels import jit\n@jit.cfunction('void()')\ndef f(): ...",
        "from realtime.kernels.jit import CFunction\nf = CFunction(g, 'void()')",
        "from realtime.kernels.folding import folded\n@folded(PARTS, each)\ndef f(x): ...",
    ],
)
def test_a_kernel_is_known_by_its_compiler(text: str) -> None:
    assert defines_kernels(ast.parse(text))
    assert not defines_kernels(ast.parse("from typing import overload\n@overload\ndef f(x): ..."))


def test_kernels_of_the_services_do_no_i_o() -> None:
    assert kernels_with_i_o(ROOT / "services") == THREADS


@pytest.mark.parametrize(
    "path",
    [
        "haptic_server/servo/force/tick.py",
        "haptic_server/servo/simulation/phantom.py",
        "sound_server/mixer.py",
    ],
)
@pytest.mark.parametrize("line", ["import os", "from zenoh import Session", "import os.path as p"])
@pytest.mark.daily("*tick.py")
def test_a_kernel_that_does_i_o_is_found(tree: Path, path: str, line: str) -> None:
    with (tree / "services" / path).open("a", encoding="utf-8") as file:
        file.write(f"\n{line}\n")
    assert kernels_with_i_o(tree / "services") == THREADS | {path}


def lint_imports(tree: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache", "--config", ROOT / "pyproject.toml"],
        cwd=tree,
        env=dict(
            os.environ,
            PYTHONPATH=os.pathsep.join(str(tree / part) for part in ("shared", "services", "lab")),
            COLUMNS="200",
        ),
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the packages, imported instead of the installed ones."""
    for part in ("services", "shared", "lab"):
        shutil.copytree(ROOT / part, tmp_path / part, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


@pytest.mark.parametrize(
    ("path", "line", "contract"), FORBIDDEN, ids=[f"{p}: {line}" for p, line, _ in FORBIDDEN]
)
@pytest.mark.daily("services/sound_server*")
def test_a_forbidden_import_is_refused(tree: Path, path: str, line: str, contract: str) -> None:
    target = tree / path
    target.write_text(f"{target.read_text(encoding='utf-8')}\n{line}\n", encoding="utf-8")
    result = lint_imports(tree)
    broken = [text for text in result.stdout.splitlines() if " BROKEN" in text]
    assert result.returncode != 0, result.stdout + result.stderr
    assert len(broken) == 1, result.stdout
    assert broken[0].startswith(contract)


def test_the_tree_as_it_is_keeps_every_contract(tree: Path) -> None:
    result = lint_imports(tree)
    assert result.returncode == 0, result.stdout + result.stderr


def test_drumstick_opens_no_files() -> None:
    # `open` needs no import, so lint-imports cannot see it.
    for path in (ROOT / "shared" / "drumstick").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = node.func if isinstance(node, ast.Call) else None
            opens = isinstance(called, ast.Name) and called.id == "open"
            assert not opens, f"{path}:{getattr(node, 'lineno', 0)} opens a file"


def test_physics_imports_the_library_only() -> None:
    """Nor does a helper that it leads to import more: what needs a service or the laboratory is tested beside it."""
    tests = ROOT / "tests"
    found = sorted((tests / "physics").rglob("*.py"))
    for path in found:  # which grows meanwhile
        names = modules_of(ast.parse(path.read_text(encoding="utf-8")))
        assert not {name.partition(".")[0] for name in names} & BEYOND_THE_LIBRARY, path
        files = {
            root / f"{name.replace('.', '/')}.py" for name in names for root in (tests, tests / "system")
        }
        found += sorted(file for file in files - set(found) if file.is_file())
    assert {tests / "stick_cases.py", tests / "stability" / "cases" / "wire.py"} <= set(found)
