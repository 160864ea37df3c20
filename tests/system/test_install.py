"""deploy/install.sh into a folder: it plays from there; an update and a rollback keep presets; nothing is left."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from rig_process import PATIENCE_S, free_port, wait_for

from realtime.kernels.store import ROOT as KERNELS

pytestmark = [pytest.mark.long, pytest.mark.timeout(1800)]
CHECKOUT = Path(__file__).resolve().parents[2]
PARTS = (
    "services",
    "shared",
    "deploy",
    "docs",
    "pyproject.toml",
    "requirements.lock",
    "README.md",
    "LICENSE",
)


def _copy_if_there(source: str, target: str) -> None:
    with suppress(FileNotFoundError):  # what another process clears away just now
        shutil.copy2(source, target)


def _checkout(to: Path, version: str) -> Path:
    for name in PARTS:
        if (CHECKOUT / name).is_dir():
            ignored = shutil.ignore_patterns("__pycache__", "images", "sounds")
            shutil.copytree(CHECKOUT / name, to / name, ignore=ignored)
        else:
            shutil.copy(CHECKOUT / name, to / name)
    project = (to / "pyproject.toml").read_text()
    (to / "pyproject.toml").write_text(project.replace('\nversion = "', f'\nversion = "{version}.', 1))
    return to


class Stage:
    """A root to install into, and the programs there."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "root"
        self.opt = self.root / "opt" / "drumstick"
        self.environment = dict(os.environ, PYTHON=sys.executable)
        for variable, place in (
            ("XDG_STATE_HOME", self.root / "var/lib/drumstick"),
            ("XDG_CACHE_HOME", self.root / "var/cache/drumstick"),
            ("XDG_RUNTIME_DIR", self.root / "run/drumstick/main"),
        ):
            place.mkdir(parents=True, mode=0o700)
            self.environment[variable] = str(place)
        # As on a machine that has played before: kernels are found by their sources, wherever a release lies.
        if KERNELS is not None:
            shutil.copytree(
                KERNELS,
                self.root / "var/cache/drumstick" / KERNELS.parent.name / KERNELS.name,
                ignore=shutil.ignore_patterns("*.tmp.*"),  # what another process compiles just now
                copy_function=_copy_if_there,
            )

    def script(self, path: Path, *words: str) -> str:
        """Run one of deploy's; what it says."""
        done = self.tried(path, *words)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def tried(self, path: Path, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [path, "--root", self.root, *words], env=self.environment, capture_output=True, text=True, check=False
        )  # fmt: skip

    def drumstick(self, *words: str) -> subprocess.CompletedProcess[str]:
        program = self.opt / "current" / "venv" / "bin" / "drumstick"
        return subprocess.run(
            [program, *words], env=self.environment, capture_output=True, text=True, check=False, cwd=self.root
        )  # fmt: skip

    def version(self) -> str:
        python = self.opt / "current" / "venv" / "bin" / "python"
        words = "from importlib.metadata import version; print(version('haptic-drumstick'))"
        return subprocess.run(
            [python, "-c", words], capture_output=True, text=True, check=True
        ).stdout.strip()

    def ports(self) -> list[str]:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        udp = [str(free_port()) for _ in range(2)]
        return ["--listen", self.endpoint, "--osc-in", udp[0], "--osc-out", f"127.0.0.1:{udp[1]}"]

    @contextmanager
    def playing(self) -> Iterator[None]:
        program = self.opt / "current" / "venv" / "bin" / "drumstick"
        process = subprocess.Popen(
            [program, "haptic", *self.ports()], env=self.environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, cwd=self.root,
        )  # fmt: skip
        try:
            wait_for("an answer of the rig", lambda: self.presets() is not None, 200.0)
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=PATIENCE_S)

    def presets(self) -> str | None:
        done = self.drumstick("preset", "list", "--connect", self.endpoint)
        return done.stdout if done.returncode == 0 else None


def test_installed_updated_rolled_back_and_removed(tmp_path: Path) -> None:
    stage = Stage(tmp_path)
    first, second = _checkout(tmp_path / "first", "1"), _checkout(tmp_path / "second", "2")
    venv = Path(sys.prefix)
    said = stage.script(first / "deploy/install.sh", "--packages-from", str(venv))
    assert "Nothing new was switched on" in said
    assert stage.version().startswith("1.")
    assert (stage.root / "usr/local/lib/systemd/system/drumstick-servo@.service").is_file()

    # A first start may have to compile: without a duration it may take its time.
    with stage.playing():
        saved = stage.drumstick("preset", "save", "kept", "--connect", stage.endpoint)
        assert saved.returncode == 0, saved.stderr
    played = stage.drumstick(
        "up", "--audio", "null", "--duration", "2", "--json", "--panel-port", str(free_port()), *stage.ports()
    )
    assert played.returncode == 0, played.stderr
    told = json.loads(played.stdout)
    assert told["strikes"] > 0
    assert told["sound"] == "null"

    env_file = stage.root / "etc/drumstick/main.env"
    env_file.write_text("SERVO_OPTIONS=--scene tom\n")
    begun = time.monotonic()
    again = stage.script(first / "deploy/install.sh")
    assert "is installed already" in again
    said = stage.script(second / "deploy/install.sh", "--role", "haptic")
    assert "taken from there" in said, (said, time.monotonic() - begun)  # the same lock: no network
    assert stage.version().startswith("2.")
    assert env_file.read_text() == "SERVO_OPTIONS=--scene tom\n"
    wants = stage.root / "etc/systemd/system/drumstick@main.target.wants"
    assert {link.name for link in wants.iterdir()} == {
        "drumstick-servo@main.service", "drumstick-gateway@main.service", "drumstick-scene@main.path",
    }  # fmt: skip

    (stage.root / "etc/drumstick/main/rig.toml").write_text('[zenoh]\npublic = "tls/0.0.0.0:7448"\n')
    stage.script(second / "deploy/install.sh", "--role", "haptic")
    assert (wants / "drumstick-door@main.service").is_symlink()

    # One that does not even start is not switched to.
    now, before = (os.readlink(stage.opt / name) for name in ("current", "previous"))
    program = stage.opt / before / "venv/bin/drumstick"
    program.chmod(0o644)
    refused = stage.tried(stage.opt / "current/deploy/rollback.sh")
    assert (refused.returncode, "nothing was switched" in refused.stderr) == (3, True), refused
    assert os.readlink(stage.opt / "current") == now
    program.chmod(0o755)
    # The power went between rollback's two steps: going on from there still goes back.
    (stage.opt / "previous").unlink()
    (stage.opt / "previous").symlink_to(now)
    stage.script(stage.opt / "current/deploy/rollback.sh")
    assert stage.version().startswith("1.")
    with stage.playing():
        wait_for("the preset that was kept", lambda: "kept" in (stage.presets() or ""))

    stage.script(first / "deploy/uninstall.sh")
    assert not stage.opt.exists()
    assert not list((stage.root / "etc/systemd/system").rglob("drumstick*"))
    assert list((stage.root / "var/lib/drumstick").rglob("kept*"))
    stage.script(first / "deploy/uninstall.sh", "--purge")
    assert not (stage.root / "var/lib/drumstick").exists()


def test_what_cannot_be_is_refused_in_words(tmp_path: Path) -> None:
    for script, words, status, told in (
        ("install.sh", ["--role", "drummer"], 2, "there is haptic"),
        ("install.sh", ["--rig", "a/b"], 2, "letters"),
        ("install.sh", ["--packages-from", str(tmp_path)], 2, "no environment"),
        ("rollback.sh", [], 3, "nothing is installed"),
        ("uninstall.sh", ["--all"], 2, "--purge"),
    ):
        done = subprocess.run(
            [CHECKOUT / "deploy" / script, "--root", tmp_path / "root", *words], capture_output=True, text=True,
            check=False, timeout=PATIENCE_S,
        )  # fmt: skip
        assert (done.returncode, told in done.stderr) == (status, True), (script, words, done)
