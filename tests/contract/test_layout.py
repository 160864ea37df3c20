"""The import contracts bite: each forbidden import, put into a copy of the tree, is refused by lint-imports."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

FORBIDDEN = [
    ("shared/drumstick/parameters/stick.py", "import socket", "drumstick does no I/O"),
    ("shared/drumstick/stick/effects/pulse.py", "from pathlib import Path", "drumstick does no I/O"),
    ("shared/drumstick/parameters/scene.py", "from protocol import keys", "drumstick imports only realtime"),
    ("shared/realtime/ring.py", "import drumstick.stick.contact", "realtime imports nothing of ours"),
    ("shared/protocol/keys.py", "import realtime.ring", "protocol imports only drumstick"),
    ("shared/drumstick/drum/step.py", "import haptic_server.block", "Services never import one another"),
    ("services/web_panel/__init__.py", "import rig", "Nothing imports rig"),
    ("services/rig/replaying/cues.py", "import haptic_server.records", "Recording and replaying meet"),
    ("shared/protocol/identity.py", "import cryptography", "Only rig makes and reads certificates"),
    ("shared/drumstick/drum/step.py", "import os", "The kernels of the services do no I/O"),
]


def lint_imports(tree: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache", "--config", ROOT / "pyproject.toml"],
        cwd=tree,
        env=dict(os.environ, PYTHONPATH=f"{tree / 'shared'}{os.pathsep}{tree / 'services'}", COLUMNS="200"),
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the packages, imported instead of the installed ones."""
    for part in ("services", "shared"):
        shutil.copytree(ROOT / part, tmp_path / part, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


@pytest.mark.parametrize(
    ("path", "line", "contract"), FORBIDDEN, ids=[f"{p}: {line}" for p, line, _ in FORBIDDEN]
)
def test_a_forbidden_import_is_refused(tree: Path, path: str, line: str, contract: str) -> None:
    target = tree / path
    target.write_text(f"{target.read_text(encoding='utf-8')}\n{line}\n", encoding="utf-8")
    result = lint_imports(tree)
    broken = [text for text in result.stdout.splitlines() if text.rstrip().endswith("BROKEN")]
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
