"""The units under deploy/systemd: systemd understands every line, and they fit the commands and folders they name."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from haptic_server import files
from haptic_server.servo.priority import FIFO_PRIORITY
from rig.exit_status import GIVEN
from rig.supervision.service import SERVICES

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "deploy" / "systemd"
UNITS = sorted(FOLDER.glob("*@.*"))
PROGRAM = "/opt/drumstick/current/venv/bin/drumstick"


def _said(folder: Path, unit: str) -> str:
    command = ["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", str(folder / unit)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=60, env={"SYSTEMD_UNIT_PATH": f"{folder}:"}
    )  # fmt: skip
    return done.stdout + done.stderr + ("" if done.returncode == 0 else f"status {done.returncode}")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The units, with a program that is there."""
    program = shutil.which("true")
    assert program
    for unit in UNITS:
        (tmp_path / unit.name).write_text(unit.read_text().replace(PROGRAM, program))
    return tmp_path


def _settings(name: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for line in (FOLDER / name).read_text().splitlines():
        key, equals, value = line.partition("=")
        if equals and not line.startswith("#"):
            found.setdefault(key, []).append(value)
    return found


@pytest.mark.needs("systemd-analyze")
@pytest.mark.parametrize("unit", [unit.name for unit in UNITS])
def test_systemd_has_nothing_to_say(folder: Path, unit: str) -> None:
    assert _said(folder, unit.replace("@", "@main")) == ""


@pytest.mark.needs("systemd-analyze")
def test_systemd_would_have_said_something(folder: Path) -> None:
    broken = folder / "drumstick-panel@.service"
    broken.write_text(broken.read_text().replace("RestartSec=", "RestartSecs="))
    assert "RestartSecs" in _said(folder, "drumstick-panel@main.service")


@pytest.mark.parametrize("service", SERVICES)
def test_each_service_has_its_unit_with_what_all_must_have(service: str) -> None:
    unit = _settings(f"drumstick-{service}@.service")
    (command,) = unit["ExecStart"]
    assert command.startswith(f"{PROGRAM} service {service} --rig %i ")
    assert ("--rig-file" in command) == (service != "servo")  # no force depends on who may speak to the rig
    assert command.endswith(f" ${service.upper()}_OPTIONS")
    assert f"#{service.upper()}_OPTIONS=" in (FOLDER / "example.env").read_text()
    assert unit["Type"] == ["notify"]
    assert unit["WatchdogSignal"] == ["SIGTERM"]
    assert unit["Restart"] == ["always"]
    assert unit["RestartPreventExitStatus"] == [str(GIVEN)]
    assert unit["MemoryDenyWriteExecute"] == ["no"]
    assert "RestrictRealtime" not in unit or service not in ("servo", "sound")
    for key in ("NoNewPrivileges", "PrivateTmp", "ProtectHome", "RestrictNamespaces"):
        assert unit[key] == ["yes"]
    assert unit["ProtectSystem"] == ["strict"]
    assert unit["User"] == ["drumstick"]


# What no process of a rig may lack, and no edit may lose unseen.
EVERYWHERE = {
    "StartLimitIntervalSec": "0",  # again and again, for weeks
    "KillMode": "mixed",
    "SystemCallFilter": "@system-service",
    "SystemCallArchitectures": "native",
    "CapabilityBoundingSet": "",
    "AmbientCapabilities": "",
    "RestrictSUIDSGID": "yes",
    "RuntimeDirectoryPreserve": "yes",  # the block of a force loop that crashed
}
# Of each: the watchdog, what SIGTERM gets before SIGKILL when it bit, the pause before a new start, and the limits.
REQUIRED = {
    "servo": {
        "WatchdogSec": "3", "TimeoutAbortSec": "2", "TimeoutStopSec": "5", "RestartSec": "100ms",
        "LimitRTPRIO": str(FIFO_PRIORITY), "LimitMEMLOCK": "infinity", "OOMScoreAdjust": "-900",
        "PrivateNetwork": "yes", "IPAddressDeny": "any", "DevicePolicy": "closed",
    },
    "gateway": {
        "WatchdogSec": "20", "TimeoutAbortSec": "5", "TimeoutStopSec": "5", "RestartSec": "100ms",
        "RestrictRealtime": "yes", "DevicePolicy": "closed",
    },
    "door": {
        "WatchdogSec": "20", "TimeoutAbortSec": "5", "TimeoutStopSec": "5", "RestartSec": "2",
        "RestrictRealtime": "yes", "PrivateDevices": "yes",
    },
    "sound": {
        "WatchdogSec": "30", "TimeoutAbortSec": "5", "TimeoutStopSec": "5", "RestartSec": "100ms",
        "LimitRTPRIO": "75", "LimitMEMLOCK": "infinity", "DevicePolicy": "closed",
    },
    "panel": {
        "WatchdogSec": "30", "TimeoutAbortSec": "5", "TimeoutStopSec": "5", "RestartSec": "2",
        "RestrictRealtime": "yes", "PrivateDevices": "yes",
    },
}  # fmt: skip


def test_another_scene_is_played_with_the_options_of_the_force_loop() -> None:
    unit = _settings("drumstick-servo@.service")
    (start,), (reload,) = unit["ExecStart"], unit["ExecReload"]
    assert reload.replace("servo-reload", "servo") == start
    assert unit["NotifyAccess"] == ["exec"]  # the reload names the next main process


@pytest.mark.parametrize("service", SERVICES)
def test_each_unit_keeps_what_it_must_have(service: str) -> None:
    unit = _settings(f"drumstick-{service}@.service")
    wanted = EVERYWHERE | REQUIRED[service]
    assert {key: unit.get(key) for key in wanted} == {key: [value] for key, value in wanted.items()}


def test_the_page_tells_the_watchdogs_as_they_are() -> None:
    page = (ROOT / "docs" / "operator.md").read_text()
    told = {
        name.strip(): seconds
        for names, seconds in re.findall(r"^\| ([a-z, ]+) \| .* for \| (\d+) s \|$", page, re.MULTILINE)
        for name in names.split(",")
    }
    assert told == {service: REQUIRED[service]["WatchdogSec"] for service in SERVICES}


def test_audio_is_below_the_force_loop() -> None:
    assert 0 < int(REQUIRED["sound"]["LimitRTPRIO"]) < FIFO_PRIORITY


def test_what_is_said_to_be_the_same_for_every_process_is() -> None:
    common = {
        service: (FOLDER / f"drumstick-{service}@.service")
        .read_text()
        .partition("# What follows is the same for every process")[2]
        .partition("[Install]")[0]
        for service in SERVICES
    }
    assert len(common["servo"].splitlines()) > 20
    assert set(common.values()) == {common["servo"]}


def test_the_force_loop_has_no_network() -> None:
    unit = _settings("drumstick-servo@.service")
    assert unit["PrivateNetwork"] == ["yes"]
    assert unit["RestrictAddressFamilies"] == ["AF_UNIX"]
    assert unit["SupplementaryGroups"] == ["dialout"]


def test_the_wish_for_a_scene_is_looked_for_where_the_gateway_leaves_it() -> None:
    (runtime,) = {
        re.search(r"XDG_RUNTIME_DIR=(\S+)", text)[1]  # type: ignore[index]
        for text in (unit.read_text() for unit in UNITS)
        if "XDG_RUNTIME_DIR" in text
    }
    (looked,) = _settings("drumstick-scene@.path")["PathExists"]
    # rig.folder: drumstick-UID-RIG below XDG_RUNTIME_DIR; the rig's own folder, so that b and a-b cannot be confused
    assert looked == f"{runtime}/drumstick-@UID@-%i/{files.WANTED}"
    change = _settings("drumstick-scene@.service")
    (forget,) = change["ExecStopPost"]
    assert looked.replace("@UID@", "*") in forget
    assert "gateway" not in " ".join(change["ExecStart"])  # it plays on, and hears a panic
    assert change["ProtectSystem"] == ["strict"]
    assert looked.startswith(f"{change['ReadWritePaths'][0]}/")
