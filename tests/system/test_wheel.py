"""The wheel alone, in an empty folder, without any extra: it plays, and says what is not installed."""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from ports import free_port

pytestmark = pytest.mark.timeout(300)
CHECKOUT = Path(__file__).resolve().parents[2]
# What the extras bring, by the names of folders and files in site-packages; and the checkout's own installation.
EXTRAS = ("viser", "websockets", "sounddevice", "_sounddevice", "scipy", "matplotlib", "rtmidi2", "zeroconf")
OWN = ("haptic_drumstick", "_haptic_drumstick", "drumstick_lab", "_drumstick_lab")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`haptic-drumstick` as installed from a wheel, beside what the distribution needs and nothing else."""
    place = tmp_path_factory.mktemp("wheel")
    uv = Path(sysconfig.get_path("scripts")) / "uv"
    built = [
        str(uv),
        "build",
        "--wheel",
        "--no-build-isolation",
        "--offline",
        "--out-dir",
        str(place),
        str(CHECKOUT),
    ]
    subprocess.run(built, check=True, capture_output=True, env=dict(os.environ, VIRTUAL_ENV=sys.prefix))
    (wheel,) = place.glob("*.whl")
    target = place / "site"
    installed = [str(uv), "pip", "install", "--offline", "--no-deps", "--target", str(target), str(wheel)]
    subprocess.run(installed, check=True, capture_output=True)
    for each in Path(sysconfig.get_path("purelib")).iterdir():
        if not each.name.lower().startswith((*EXTRAS, *OWN)) and each.suffix != ".pth":
            (target / each.name).symlink_to(each)
    return target / "bin" / "haptic-drumstick"


def run(program: Path, *words: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Without the environment's own packages (-S), nor the checkout's."""
    environment = dict(os.environ, PYTHONPATH=str(program.parent.parent), XDG_STATE_HOME=str(cwd / "state"))
    command = [sys.executable, "-S", str(program), *words]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def test_it_plays_in_an_empty_folder_and_says_what_is_not_there(program: Path, tmp_path: Path) -> None:
    ports = ["--osc-in", str(free_port()), "--listen", f"tcp/127.0.0.1:{free_port()}", "--rig", "wheel"]
    played = run(program, "up", "--duration", "2", "--json", *ports, cwd=tmp_path)
    assert played.returncode == 0, played.stderr
    summary = json.loads(played.stdout)
    assert summary["strikes_played"] > 10
    assert "plays without the technician's page" in played.stderr
    assert "-m pip install 'viser" in played.stderr
    assert (tmp_path / "drumstick-roll.wav").stat().st_size > 100_000
    assert "restarted" not in played.stderr


def test_doctor_says_what_to_type_for_each_extra(program: Path, tmp_path: Path) -> None:
    told = run(program, "doctor", "--json", cwd=tmp_path)
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
