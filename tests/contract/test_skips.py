"""With CI=true a skip is a failure; elsewhere a test that lacks a tool skips and says what to install."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SUITE = {
    "test_needs.py": "import pytest\n@pytest.mark.needs('chromium')\ndef test_page(): pass\n",
    "test_inside.py": "import pytest\ndef test_it(): pytest.skip('because')\n",
    "test_module.py": "import pytest\npytest.skip('all of it', allow_module_level=True)\n",
    "test_expected.py": "import pytest\n@pytest.mark.xfail(reason='known')\ndef test_it(): assert 0\n",
    "test_good.py": "def test_it(): pass\n",
    "system/test_last.py": "def test_system(): pass\n",
}


def _run(folder: Path, name: str, ci: str) -> subprocess.CompletedProcess[str]:
    tests = folder / "tests"
    (tests / "system").mkdir(parents=True)
    shutil.copy(ROOT / "tests" / "conftest.py", tests)
    shutil.copy(ROOT / "pyproject.toml", folder)
    (folder / "deploy").mkdir()
    shutil.copy(ROOT / "deploy" / "system-packages.txt", folder / "deploy")
    for path, text in SUITE.items():
        (tests / path).write_text(text, encoding="utf-8")
    # A PATH without any program: the needed one cannot be there.
    environment = dict(os.environ, CI=ci, PATH=str(folder))
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-v",
        "-p",
        "no:cacheprovider",
        f"tests/{name}" if name else "tests",
    ]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=100
    )


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("test_needs.py", "apt-get install chromium"),
        ("test_inside.py", "because"),
        ("test_module.py", "all of it"),
    ],
)
def test_a_skip_fails_in_ci_and_only_there(tmp_path: Path, name: str, reason: str) -> None:
    in_ci = _run(tmp_path / "ci", name, "true")
    assert in_ci.returncode not in (0, 5), in_ci.stdout
    assert "nothing may be skipped" in in_ci.stdout
    assert reason in in_ci.stdout
    elsewhere = _run(tmp_path / "elsewhere", name, "")
    assert elsewhere.returncode in (0, 5), (
        elsewhere.stdout
    )  # 5: a file that skips itself leaves nothing to run
    assert "1 skipped" in elsewhere.stdout
    assert reason in elsewhere.stdout


@pytest.mark.parametrize("name", ["test_expected.py", "test_good.py"])
def test_what_is_no_skip_stays_as_it_is(tmp_path: Path, name: str) -> None:
    assert _run(tmp_path, name, "true").returncode == 0


def test_system_tests_come_last(tmp_path: Path) -> None:
    lines = [line for line in _run(tmp_path, "", "").stdout.splitlines() if "::" in line and "[" in line]
    assert len(lines) >= 4
    assert "system/test_last.py::test_system" in lines[-1]
