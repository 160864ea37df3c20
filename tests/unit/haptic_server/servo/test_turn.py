"""A servo that waits for its turn: it takes nothing before the file `turn` names its process."""

import os
from pathlib import Path
from typing import Any

import pytest

from haptic_server import files
from haptic_server.servo import process
from haptic_server.servo.device.selection import may_be_opened_twice


class Looks:
    """A stop request that comes after so many looks, and what happens at each."""

    def __init__(self, run: Path, turns: list[str]) -> None:
        self._run, self._turns = run, turns
        self.seen_ready: list[bool] = []

    def wait(self, _seconds: float) -> bool:
        self.seen_ready.append((self._run / files.NEXT / files.SERVO_READY).exists())
        if not self._turns:
            return True
        if turn := self._turns.pop(0):
            (self._run / files.TURN).write_text(turn)
        return False


@pytest.mark.parametrize(
    ("turns", "turn_by", "has_turn"),
    [
        (["", "", str(os.getpid())], os.getppid(), True),
        (["", "1", f"{os.getpid()}0"], os.getppid(), False),
        ([], os.getppid(), False),
        (
            ["", str(os.getpid())],
            os.getpid(),
            False,
        ),  # who would give it has ended: another is our parent now
        ([str(os.getpid())], os.getpid(), True),  # it ended after it gave it
    ],
    ids=["named", "another is named", "stopped", "nobody is there to give it", "given, then nobody"],
)
def test_only_the_process_that_is_named_has_its_turn(
    tmp_path: Path, turns: list[str], turn_by: int, has_turn: bool
) -> None:
    (tmp_path / files.NEXT).mkdir()
    looks: Any = Looks(tmp_path, turns)
    assert process._await_turn(tmp_path, turn_by, looks) is has_turn
    assert all(looks.seen_ready)


@pytest.mark.parametrize(
    ("device", "may"),
    [("simulated", True), ("pointer", True), ("replay:x.csv", True), ("openhaptics", False), ("mine", False)],
)
def test_no_device_with_an_arm_is_opened_beforehand(device: str, may: bool) -> None:
    assert may_be_opened_twice(device) is may


@pytest.mark.parametrize("device", ["simulated", "mine"])
def test_an_arm_is_opened_only_after_its_turn_has_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, device: str
) -> None:
    order: list[str] = []

    def made_ready(*_: object) -> None:
        order.append("opened")
        raise process.DeviceError("enough")

    def turn(*_: object) -> bool:
        order.append("turn")
        return True

    monkeypatch.setattr(process, "_made_ready", made_ready)
    monkeypatch.setattr(process, "_await_turn", turn)
    given = process.ServoOptions(run_dir=tmp_path, device=device, turn_by=os.getppid())
    nothing: Any = None
    with pytest.raises(process.DeviceError):
        process._play(nothing, nothing, given, nothing)
    assert order == (["opened"] if device == "simulated" else ["turn", "opened"])
