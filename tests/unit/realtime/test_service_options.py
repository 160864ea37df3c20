"""Options of a service as one JSON argument: there and back, mistakes in one line, nothing heavy imported."""

import subprocess
import sys
from pathlib import Path

import pytest

from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.options import ServoOptions
from protocol.access.identity import Identity
from realtime.service_options import command, options_of_process, read
from rig.recording.options import RecordingOptions
from web_panel.options import PanelOptions

FOLDER = Path("/run/drumstick")


def test_there_and_back() -> None:
    identity = Identity(Path("ca.pem"), Path("a.pem"), Path("a.key"))
    given = GatewayOptions(
        run_dir=FOLDER, state_dir=Path("state"), connect="tls/a:7448", identity=identity, osc_out=(("ü", 9101),),
        osc_allow=("10.0.0.0/8",), midi_out="--x",
    )  # fmt: skip
    python, flag, module, text = command("haptic_server.gateway", given)
    assert (python, flag, module) == (sys.executable, "-m", "haptic_server.gateway")
    assert read(GatewayOptions, text) == given


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [
        (ServoOptions, '{"run_dir": 5}', "path as `str`, got `int` - at `$.run_dir`"),
        (ServoOptions, '{"run_dir": null}', "$.run_dir"),
        (ServoOptions, "{}", "run_dir"),
        (ServoOptions, '{"run_dir": "a", "devise": "x"}', "devise"),
        (ServoOptions, "not JSON", "malformed"),
        (GatewayOptions, '{"run_dir": "a", "state_dir": "b", "osc_allow": ["10.0.0.0/99"]}', "10.0.0.0/99"),
        (GatewayOptions, '{"run_dir": "a", "state_dir": "b", "rig": "a/b"}', "a/b"),
        (GatewayOptions, '{"run_dir": "a", "state_dir": "b", "osc_in": ["127.0.0.1", 70000]}', "$.osc_in"),
        (GatewayOptions, '{"run_dir": "a", "state_dir": "b", "identity": ["a", "b", 3]}', "$.identity"),
        (RecordingOptions, '{"rig": "*", "connect": "tcp/a:1", "out": "x.mcap"}', "*"),
        (PanelOptions, '{"token_file": "t", "port": -1}', "$.port"),
    ],
)
def test_mistakes_are_named(kind: type[ServoOptions], text: str, words: str) -> None:
    with pytest.raises(ValueError) as mistake:  # noqa: PT011  the words follow
        read(kind, text)
    assert words in str(mistake.value)
    assert "\n" not in str(mistake.value)


@pytest.mark.parametrize("arguments", [[], ["{}"], ["{}", "{}"]])
def test_a_process_without_its_options_ends_with_one_line_and_status_2(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["servo", *arguments])
    with pytest.raises(SystemExit) as ended:
        options_of_process(ServoOptions, "haptic_server.servo")
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("haptic_server.servo: ")


def test_a_name_that_is_no_text_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="not UTF-8 text"):
        command("haptic_server.servo", ServoOptions(run_dir=Path("/tmp/\udcff")))


def test_whoever_starts_services_brings_no_compiler_along() -> None:
    program = (
        "import sys, rig.supervision.plan; print(sorted({'numba', 'numpy', 'zenoh'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
