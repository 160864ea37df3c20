"""docs/extend.md shows docs/template as it is, and a stranger who installs that package plays it and passes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEMPLATE = ROOT / "docs" / "template"
PAGE = (ROOT / "docs" / "extend.md").read_text(encoding="utf-8")


def run_there(folder: Path, *arguments: str) -> str:
    """Output of Python in a process that has the package installed in `folder`, on top of what we have."""
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=230,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.mark.parametrize(
    ("language", "file"),
    [("toml", "pyproject.toml"), ("python", "my_drum.py"), ("python", "test_my_drum.py")],
)
def test_the_page_shows_the_package_as_it_is(language: str, file: str) -> None:
    assert f"```{language}\n{(TEMPLATE / file).read_text(encoding='utf-8')}```" in PAGE


def test_a_scene_plays_its_effect_as_the_page_says(own_package: Path) -> None:
    (piece,) = re.findall(
        r"```python\n(import drumstick as ds\n\nscene.*?)```\n\n```text\n(.*?)```", PAGE, re.DOTALL
    )
    assert run_there(own_package, "-c", piece[0]) == piece[1]


@pytest.mark.long
def test_the_package_passes_its_own_tests(own_package: Path) -> None:
    assert "2 passed" in run_there(
        own_package,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-c",
        os.devnull,
        str(TEMPLATE / "test_my_drum.py"),
    )


SAME = """
import numpy as np
import drumstick as ds
scene = ds.scene("[stick]\\n[effects.pulse]\\n[effects.sticky]\\nforce_N = 0.05\\n")
ticks = ds.servo(scene, 2.0).strikes["speed_m_per_s"]
exact = -ds.simulate(scene, 2.0, v0_m_per_s=scene.hand.throw_m_per_s).contacts["v_in_m_per_s"]
n = min(len(ticks), len(exact))
assert n > 20, n
assert np.allclose(ticks[:n], exact[:n], rtol=1e-9), (ticks[:n], exact[:n])
"""


@pytest.mark.long
def test_the_live_tick_strikes_as_the_offline_run_does(own_package: Path) -> None:
    run_there(own_package, "-c", SAME)
