"""sdist and wheel: what they hold; `uvx haptic-drumstick` from an index, in an empty folder, without extras."""

import functools
import json
import os
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
from collections.abc import Generator
from importlib import metadata
from pathlib import Path

import pytest

import local_index
from ports import free_port

# The first start of the wheel compiles every kernel, perhaps beside other programs.
pytestmark = pytest.mark.timeout(1200)
CHECKOUT = Path(__file__).resolve().parents[2]
UV = Path(sysconfig.get_path("scripts")) / "uv"


def build(source: Path, to: Path, *how: str) -> Path:
    """The one wheel that `uv build` makes of `source`, by this environment's own hatchling."""
    command = [str(UV), "build", *how, "--no-build-isolation", "--offline", "--out-dir", str(to), str(source)]
    subprocess.run(command, check=True, capture_output=True, env=dict(os.environ, VIRTUAL_ENV=sys.prefix))
    (wheel,) = to.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, made of the sdist beside it."""
    return build(CHECKOUT, tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="module")
def index(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """Address of an index that has the wheel, what it needs and what figures need; nothing else, no build tool."""
    place = tmp_path_factory.mktemp("index")
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found: dict[str, metadata.Distribution] = {}
    local_index.needed([*project["dependencies"], *project["optional-dependencies"]["figures"]], found)
    with local_index.served(
        [built, *(local_index.wheel_again(each, place) for each in found.values())], place
    ) as at:
        yield at


@pytest.fixture(scope="module")
def environment(index: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Variables by which uvx knows this index only, and keeps what it installs for this module."""
    lacking = {"PYTHONPATH", "VIRTUAL_ENV", "UV_EXTRA_INDEX_URL", "UV_FIND_LINKS"}
    kept = {name: value for name, value in os.environ.items() if name not in lacking}
    cache = str(tmp_path_factory.mktemp("uv"))
    return kept | {
        "UV_DEFAULT_INDEX": index,
        "UV_CACHE_DIR": cache,
        "UV_PYTHON": sys.executable,
        "UV_NO_CONFIG": "1",
    }


def uvx(environment: dict[str, str], *words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = environment | {"XDG_STATE_HOME": str(cwd / "state")}
    command = [str(UV.with_name("uvx")), *words]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def test_the_sdist_holds_what_the_wheel_is_made_of_and_no_more(built: Path, tmp_path: Path) -> None:
    (sdist,) = built.parent.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {name.partition("/")[0] for name in names} == {
        "services", "shared", "pyproject.toml", "PKG-INFO", ".gitignore",
        "LICENSE", "CHANGELOG.md", "CITATION.cff",
    }  # fmt: skip
    assert build(CHECKOUT, tmp_path, "--wheel").read_bytes() == built.read_bytes()


@pytest.mark.long
def test_it_plays_in_an_empty_folder_and_says_what_is_not_there(
    environment: dict[str, str], tmp_path: Path
) -> None:
    ports = ["--osc-in", str(free_port()), "--listen", f"tcp/127.0.0.1:{free_port()}", "--rig", "wheel"]
    played = uvx(environment, "haptic-drumstick", "up", "--duration", "2", "--json", *ports, cwd=tmp_path)
    assert played.returncode == 0, played.stderr
    summary = json.loads(played.stdout)
    assert summary["strikes_played"] > 0  # how many of two seconds is the machine's affair
    assert "plays without the technician's page" in played.stderr
    assert "uv pip install --python" in played.stderr
    assert (tmp_path / "drumstick-roll.wav").stat().st_size > 100_000
    assert "restarted" not in played.stderr


@pytest.mark.long
def test_doctor_says_what_to_type_for_each_extra(environment: dict[str, str], tmp_path: Path) -> None:
    told = uvx(environment, "haptic-drumstick", "doctor", "--json", cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    findings = {each["name"]: each for each in json.loads(told.stdout)["findings"]}
    for name, package in (
        ("sound card", "sounddevice"),
        ("technician's page", "viser"),
        ("figures", "matplotlib"),
        ("OSCQuery", "zeroconf"),
    ):
        assert findings[name]["found"] == "not installed", name
        assert package in findings[name]["remedy"]
    assert not any("make install" in each["remedy"] for each in findings.values())


@pytest.mark.long
@pytest.mark.needs("pipx")
def test_pipx_runs_it_too(index: str, tmp_path: Path) -> None:
    pip = {
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_INDEX_URL": index,
        "PIP_FIND_LINKS": "",
        "PIP_EXTRA_INDEX_URL": "",
    }
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    own = {"PIPX_HOME": str(tmp_path / "pipx"), "PIPX_DEFAULT_PYTHON": sys.executable}
    told = subprocess.run(
        ["pipx", "run", "haptic-drumstick", "doctor", "--json"], cwd=tmp_path, env=kept | pip | own,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    assert json.loads(told.stdout)["playable"]


@pytest.mark.long
def test_a_strangers_script_runs_on_the_wheel_with_figures(
    environment: dict[str, str], tmp_path: Path
) -> None:
    script = tmp_path / "stranger.py"
    script.write_bytes((CHECKOUT / "docs/notebooks/stranger.py").read_bytes())
    told = uvx(
        environment | {"MPLBACKEND": "agg"}, "--from", "haptic-drumstick[figures]", "python", str(script), cwd=tmp_path
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    assert len(told.stdout.splitlines()) == 4
    assert {path.name for path in tmp_path.glob("*.*")} == {
        "stranger.py", "return-map-0.1.png", "return-map-0.2.png", "return-map-0.4.png", "roll.wav"
    }  # fmt: skip


@pytest.mark.long
def test_a_strangers_script_passes_a_strict_type_checker(environment: dict[str, str], tmp_path: Path) -> None:
    """With the wheel as it is installed, and none of this project's settings."""
    uv = functools.partial(
        subprocess.run, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
    )
    uv([str(UV), "venv", "there"])
    uv([str(UV), "pip", "install", "--python", "there", "haptic-drumstick[figures]"])
    (tmp_path / "stranger.py").write_bytes((CHECKOUT / "docs/notebooks/stranger.py").read_bytes())
    (tmp_path / "pyrightconfig.json").write_text('{"typeCheckingMode": "strict"}')
    checked = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", "there/bin/python", "stranger.py"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (checked.returncode, checked.stdout.splitlines()[-1]) == (
        0,
        "0 errors, 0 warnings, 0 informations",
    )
