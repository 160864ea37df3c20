"""Wrong input and missing parts of the machine: one clear line and the right exit status, never a traceback."""

import math
import time
from pathlib import Path

import pytest
from msgspec.structs import replace

from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.block_header import ARM, HEARTBEAT
from haptic_server.gateway.options import GatewayOptions
from realtime.atomics import peek, poke
from realtime.service_options import read
from rig import checks, extras, folder, service_checks
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.network import ports
from rig.supervision import arm
from rig.supervision.plan import Options, commands


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def test_a_file_in_place_of_the_run_folder(runtime: Path) -> None:
    made = folder.run_folder("here")
    made.rmdir()
    made.touch()
    with pytest.raises(CommandError, match="in the way") as stop:
        folder.run_folder("here")
    assert stop.value.status == LACKING


def test_a_symlink_in_place_of_the_run_folder(runtime: Path) -> None:
    made = folder.run_folder("here")
    made.rmdir()
    made.symlink_to(runtime / "nowhere")
    with pytest.raises(CommandError, match="in the way"):
        folder.run_folder("here")
    (runtime / "nowhere").mkdir(mode=0o700)
    with pytest.raises(CommandError, match="belongs to another user"):
        folder.run_folder("here")


def test_a_lock_or_scene_that_cannot_be_written(runtime: Path) -> None:
    made = folder.run_folder("here")
    (made / "lock").mkdir()
    with pytest.raises(CommandError, match="cannot be written") as stop:
        folder.claim(made, "here")
    assert stop.value.status == LACKING
    (made / "scene.toml").mkdir()
    with pytest.raises(CommandError, match="cannot be written"):
        folder.put_text(made / "scene.toml", "")
    assert sorted(p.name for p in made.iterdir()) == ["lock", "scene.toml"]


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:99999", "tcp/127.0.0.1:0", "tcp/:7447", "here"])
def test_an_endpoint_that_is_none(endpoint: str) -> None:
    with pytest.raises(CommandError) as stop:
        checks.endpoint(endpoint)
    assert stop.value.status == GIVEN


def test_a_target_whose_name_nobody_knows() -> None:
    with pytest.raises(CommandError, match="nosuch") as stop:
        checks.known_target("nosuch.invalid:9101")
    assert stop.value.status == LACKING
    assert checks.known_target("localhost:9101") == "localhost:9101"
    assert checks.target("nosuch.invalid:9101") == "nosuch.invalid:9101"


def test_nothing_listens_at_a_name_nobody_knows() -> None:
    assert not ports.listens("nosuch.invalid", 7447)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("9102", ("127.0.0.1", 9102)),
        ("127.0.0.1:1", ("127.0.0.1", 1)),
        ("localhost:65535", ("127.0.0.1", 65535)),
    ],
)
def test_where_oscquery_is_served(text: str, expected: tuple[str, int]) -> None:
    assert checks.oscquery(text, False) == expected
    assert checks.oscquery(None, False) is None


@pytest.mark.parametrize(
    "text", ["", "x", "0", "65536", "-1", ":9102", "127.0.0.1:", "127.0.0.1:x", "9102 ", "²"]
)
def test_where_oscquery_cannot_be_served(text: str) -> None:
    with pytest.raises(CommandError, match="write \\[host:\\]port") as stop:
        checks.oscquery(text, False)
    assert stop.value.status == GIVEN


@pytest.mark.parametrize(("port", "note", "channel"), [
    ("", 38, 10), (" ", 38, 10), ("a\nb", 38, 10), ("x", -1, 10), ("x", 128, 10), ("x", 38, 0), ("x", 38, 17),
])  # fmt: skip
def test_midi_that_cannot_be(port: str, note: int, channel: int) -> None:
    with pytest.raises(CommandError, match="--midi-") as stop:
        service_checks.midi(port, note, channel)
    assert stop.value.status == GIVEN
    service_checks.midi("x", 0, 16)


@pytest.mark.parametrize(("port", "notes", "curve", "channel"), [
    ("", "", 1.0, 0), ("x", "36", 1.0, 0), ("x", "", 0.0, 0), ("x", "", math.nan, 0), ("x", "", 1.0, 17),
])  # fmt: skip
def test_notes_in_that_cannot_be(port: str, notes: str, curve: float, channel: int) -> None:
    with pytest.raises(CommandError, match="--midi-in") as stop:
        service_checks.midi_in(port, notes, curve, channel)
    assert stop.value.status == GIVEN
    service_checks.midi_in("x", "36:0", 1.0, 0)


def test_windows_makes_no_virtual_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "win32")
    with pytest.raises(CommandError, match="loopback driver") as stop:
        service_checks.midi("virtual", 38, 10)
    assert stop.value.status == LACKING


def test_an_extra_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    declared = ["numpy<3,>=2", "no-such<3,>=2; extra == 'x'", "numpy>=2; extra == 'x'", "other; extra == 'y'"]
    monkeypatch.setattr("rig.extras.metadata.requires", lambda _: declared)
    words = r"--x needs what is not installed; type: .* -m pip install 'no-such<3,>=2'$"
    with pytest.raises(CommandError, match=words) as stop:
        extras.require("--x", "x")
    assert stop.value.status == LACKING


def test_extras_are_words_of_the_gateway_only_when_asked_for(runtime: Path) -> None:
    plain = read(GatewayOptions, commands(Options("r", runtime, runtime))["gateway"][-1])
    assert (plain.oscquery, plain.midi_out) == (None, None)
    asked = Options("r", runtime, runtime, query=("127.0.0.1", 9102), midi_out="--x", midi_note=40)
    given = read(GatewayOptions, commands(asked)["gateway"][-1])
    assert given == replace(plain, oscquery=("127.0.0.1", 9102), midi_out="--x", midi_note=40)


def test_arm_without_a_servo_or_with_a_dead_one_arms_nothing(
    runtime: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(arm, "_PATIENCE_S", 0.05)
    with pytest.raises(CommandError, match="no servo of rig 'here' runs") as stop:
        arm.arm("here")
    assert stop.value.status == LACKING
    mine = blocks.create(folder.run_folder("here"), law_of(Scene("bare")))
    with pytest.raises(CommandError, match="does not tick") as stop:
        arm.arm("here")
    assert stop.value.status == LACKING
    assert peek(mine.control, ARM) == 0
    poke(mine.control, HEARTBEAT, time.monotonic_ns() + 10**12)
    arm.arm("here")
    assert peek(mine.control, ARM) == 1
    assert "armed" in capsys.readouterr().out
