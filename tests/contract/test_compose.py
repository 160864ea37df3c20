"""deploy/compose, read without an engine: real command lines, no root, and nothing that can be written but volumes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from rig.cli.command import app
from rig.identity.keys import ROUTER_FILE

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "deploy" / "compose"
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((FOLDER / "compose.yaml").read_text(encoding="utf-8"))[
    "services"
]
OURS = sorted(name for name, service in SERVICES.items() if service["image"] == "haptic-drumstick")


def test_there_is_a_part_for_each_machine() -> None:
    assert OURS == ["haptic", "panel", "sound"]
    assert set(SERVICES) == {*OURS, "router"}
    assert {name: service["profiles"] for name, service in SERVICES.items()} == {
        name: [name] for name in SERVICES
    }


@pytest.mark.parametrize("name", OURS)
def test_its_command_is_one_that_drumstick_takes(name: str) -> None:
    whole: Any = typer.main.get_command(app)
    part, *options = SERVICES[name]["command"]
    assert part == name
    found = whole.commands[part].make_context(part, options).params
    assert found["rig_file"] == Path("/keys/rig.toml")
    bad: Any = whole.commands[part]
    with pytest.raises(Exception, match="No such option"):  # the parser that says so is the real one
        bad.make_context(part, [*options, "--no-such-thing"])


def test_the_router_starts_with_the_file_that_its_keys_come_with() -> None:
    assert SERVICES["router"]["command"] == ["-c", ROUTER_FILE]
    assert SERVICES["router"]["working_dir"] == "/keys"


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_nobody_is_root_and_only_volumes_can_be_written(name: str) -> None:
    service = SERVICES[name]
    assert service["user"] == "1000:1000"
    assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"])
    assert "privileged" not in service
    writable = [volume for volume in service["volumes"] if not volume.endswith(":ro")]
    assert all(re.fullmatch(r"[a-z]+-(state|cache):/(state|cache)", volume) for volume in writable)
    assert any(volume.endswith(":/keys:ro") for volume in service["volumes"])


def test_no_engine_gives_back_the_force_that_a_panic_took_away() -> None:
    # The run folder, which knows of the panic, ends with the container.
    assert SERVICES["haptic"]["restart"] == "no"
    assert any(mount.startswith("/run/drumstick") for mount in SERVICES["haptic"]["tmpfs"])
    others = {service["restart"] for name, service in SERVICES.items() if name != "haptic"}
    assert others == {"unless-stopped"}


@pytest.mark.parametrize("name", ["haptic", "sound"])
def test_what_plays_in_real_time_may_do_so(name: str) -> None:
    assert SERVICES[name]["ulimits"] == {"rtprio": 95, "memlock": -1}


def test_the_image_copies_what_is_there_and_gives_the_folders_that_compose_fills() -> None:
    lines = (FOLDER / "Containerfile").read_text(encoding="utf-8")
    copied = [word for line in re.findall(r"^COPY (.*) \S+$", lines, re.MULTILINE) for word in line.split()]
    assert {"services", "shared", "requirements.lock"} <= set(copied)
    assert [word for word in copied if not (ROOT / word).exists()] == []
    assert "\nUSER 1000:1000\n" in lines
    assert 'ENTRYPOINT ["drumstick"]' in lines
    for variable, folder in (
        ("RUNTIME_DIR", "/run/drumstick"),
        ("STATE_HOME", "/state"),
        ("CACHE_HOME", "/cache"),
    ):
        assert f"XDG_{variable}={folder}" in lines
