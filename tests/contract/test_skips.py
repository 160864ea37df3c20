"""With CI=true a skip is a failure; elsewhere a test that lacks a tool skips and says what to install."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

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


def _run(folder: Path, ci: str) -> dict[str, str]:
    """Outcome of each file's test, or of the file, and of the whole ("exit")."""
    tests = folder / "tests"
    (tests / "system").mkdir(parents=True)
    for name in ("conftest.py", "alone.py"):
        shutil.copy(ROOT / "tests" / name, tests)
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
        "tests",
        "--junitxml",
        "said.xml",
        "--continue-on-collection-errors",
    ]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=100
    )
    said = {"exit": str(done.returncode), "order": ""}
    for case in ElementTree.parse(folder / "said.xml").iter("testcase"):
        name = str(case.get("classname") or case.get("name")).removeprefix("tests.")
        (outcome, words) = next(
            ((part.tag, f"{part.get('message')} {part.text}") for part in case), ("passed", "")
        )
        said[name] = f"{outcome} {words}"
        said["order"] += f"{name} "
    return said


@pytest.fixture(scope="module")
def in_ci(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return _run(tmp_path_factory.mktemp("ci"), "true")


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return _run(tmp_path_factory.mktemp("elsewhere"), "")


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("test_needs", "apt-get install chromium"),
        ("test_inside", "because"),
        ("test_module", "all of it"),
    ],
)
def test_a_skip_fails_in_ci_and_only_there(
    in_ci: dict[str, str], elsewhere: dict[str, str], name: str, reason: str
) -> None:
    assert in_ci["exit"] not in ("0", "5")
    assert in_ci[name].startswith(("failure", "error")), in_ci
    assert "nothing may be skipped" in in_ci[name]
    assert reason in in_ci[name]
    assert elsewhere["exit"] == "0"
    assert elsewhere[name].startswith("skipped"), elsewhere
    assert reason in elsewhere[name]


@pytest.mark.long
def test_what_is_no_skip_stays_as_it_is(in_ci: dict[str, str]) -> None:
    assert in_ci["test_expected"].startswith("skipped"), in_ci
    assert in_ci["test_good"] == "passed "


@pytest.mark.long
def test_system_tests_come_last(elsewhere: dict[str, str]) -> None:
    assert len(elsewhere) > 5
    assert elsewhere["order"].split()[-1] == "system.test_last"
