"""The servo process with a PHANTOM's driver, on the stand-in library: it plays, ends with its device, says why not."""

import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rig_process import wait_for

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block, files
from haptic_server.records import FAULT, READY, STALLED, STATUS, UNPLUGGED
from haptic_server.servo.device.openhaptics.driver import library
from haptic_server.servo.options import ServoOptions
from hd_stand_in import CENTRE_MM, build
from realtime import triple_buffer
from realtime.service_options import command

pytestmark = [pytest.mark.needs("cc"), pytest.mark.real_clock, pytest.mark.timeout(900)]
SCENE = shipped_text("phantom")
# The hand goes 15 mm above and below the head, each way in 0.2 s.
SWING = f"{CENTRE_MM[1]} 15 0.4"


@pytest.fixture(scope="module")
def stand_in(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("stand-in"))


class Servo:
    """The process, and what its block says."""

    def __init__(self, run_dir: Path, stand_in: Path | None, **environment: str) -> None:
        self.run_dir = run_dir
        (run_dir / files.SCENE).write_text(SCENE, encoding="utf-8")
        named = {library.VARIABLE: str(stand_in)} if stand_in else {}
        self.process = subprocess.Popen(
            command("haptic_server.servo", ServoOptions(run_dir=run_dir, device="openhaptics")),
            env={**os.environ, **named, **environment},
            stderr=subprocess.PIPE,
            text=True,
        )

    def status(self) -> np.void | None:
        """The newest status; None before there is a block."""
        try:
            seen = block.attach(self.run_dir, law_of(parse(SCENE, "phantom")).dtype)
        except FileNotFoundError:
            return None
        out = np.zeros(1, STATUS)
        triple_buffer.read_into(seen.status_cells, seen.status, out)
        return out[0]

    def wait(self, what: str, test: Callable[[np.void], bool]) -> np.void:
        """The first status that passes."""

        def found() -> np.void | None:
            assert self.process.poll() is None, self.process.communicate()[1]
            status = self.status()
            return status if status is not None and test(status) else None

        return wait_for(what, found, 150.0)

    def end(self) -> tuple[int, str]:
        """Wait for its end; exit status and what it said."""
        said = self.process.communicate(timeout=150)[1]
        return self.process.returncode, said


def test_it_plays(tmp_path: Path, stand_in: Path) -> None:
    servo = Servo(tmp_path, stand_in, STAND_IN_SWING=SWING)
    try:
        first = servo.wait("ticks", lambda status: bool(status["tick"] > 0))
        assert first["status"] >= READY
        servo.wait(
            "strikes or a stall", lambda status: bool(status["strikes"] >= 3 or status["status"] == FAULT)
        )
    finally:
        servo.process.send_signal(signal.SIGTERM)
    _, said = servo.end()
    assert "opened as the default (NULL)" in said
    assert "PHANTOM Premium 1.5" in said


@pytest.mark.long
def test_it_ends_in_good_order_when_asked(tmp_path: Path, stand_in: Path) -> None:
    servo = Servo(tmp_path, stand_in)
    try:
        servo.wait("ticks", lambda status: bool(status["tick"] > 0))
    finally:
        servo.process.send_signal(signal.SIGTERM)
    code, said = servo.end()
    assert code == 0, said


def test_a_device_that_goes_ends_the_process_and_leaves_the_fault_in_the_block(
    tmp_path: Path, stand_in: Path
) -> None:
    servo = Servo(tmp_path, stand_in, STAND_IN_UNPLUG="300")
    code, said = servo.end()
    assert code == 1, said
    assert "ended by the device does not answer (HD error 0x0302" in said
    assert "the driver's servo thread" in said
    status = servo.status()
    assert status is not None
    assert (status["status"], status["force_N"]) == (FAULT, 0.0)
    # The first fault stays: the thread plays for a moment before it has its priority, and the machine may stand still.
    assert status["fault"] in (UNPLUGGED, STALLED)


@pytest.mark.long
@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({library.VARIABLE: "/nowhere/libHD.so"}, "/nowhere/libHD.so: cannot open shared object file"),
        ({"STAND_IN_UNPLUG": "0"}, "the device does not answer"),
    ],
)
def test_without_a_device_it_says_what_is_missing(
    tmp_path: Path, stand_in: Path, environment: dict[str, str], words: str
) -> None:
    code, said = Servo(tmp_path, stand_in, **environment).end()
    assert code == 3, said
    assert words in said
    assert "GTDD_HOME" in said
    assert "Traceback" not in said
