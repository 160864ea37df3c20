"""A servo that waits for its turn: it takes nothing before a byte comes by the pipe."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from haptic_server import files
from haptic_server.servo import process
from haptic_server.servo.device.selection import may_be_opened_twice


@pytest.fixture
def pipe(tmp_path: Path) -> Iterator[list[int]]:
    """Both ends, for the servo and for whoever gives the turn; those that are left open are closed."""
    (tmp_path / files.NEXT).mkdir()
    ends = list(os.pipe())
    yield ends
    for end in ends:
        os.close(end)


class Looks:
    """A stop request that is looked at before each look at the pipe; `then` happens at the third."""

    def __init__(self, then: Callable[[], object]) -> None:
        self._left, self._then = 3, then
        self.asked = False

    def ask(self) -> None:
        self.asked = True

    def is_set(self) -> bool:
        self._left -= 1
        if self._left == 0:
            self._then()
        return self.asked


def test_a_byte_is_the_turn(tmp_path: Path, pipe: list[int]) -> None:
    ready = tmp_path / files.NEXT / files.SERVO_READY

    def give() -> None:
        assert ready.exists()
        os.write(pipe[1], b"\n")

    looks: Any = Looks(give)
    assert process._await_turn(tmp_path, pipe[0], looks)


def test_with_the_end_of_the_process_that_gives_it_no_turn_comes(tmp_path: Path, pipe: list[int]) -> None:
    looks: Any = Looks(lambda: os.close(pipe.pop()))
    assert not process._await_turn(tmp_path, pipe[0], looks)


def test_a_turn_that_was_given_outlives_the_process_that_gave_it(tmp_path: Path, pipe: list[int]) -> None:
    os.write(pipe[1], b"\n")
    os.close(pipe.pop())
    looks: Any = Looks(pytest.fail)
    assert process._await_turn(tmp_path, pipe[0], looks)


def test_who_is_left_over_marks_no_later_scene_as_ready(tmp_path: Path, pipe: list[int]) -> None:
    os.close(pipe.pop())
    looks: Any = Looks(pytest.fail)
    assert not process._await_turn(tmp_path, pipe[0], looks)
    assert not (tmp_path / files.NEXT / files.SERVO_READY).exists()


def test_who_is_asked_to_stop_takes_no_turn(tmp_path: Path, pipe: list[int]) -> None:
    looks: Any = Looks(lambda: looks.ask())
    assert not process._await_turn(tmp_path, pipe[0], looks)


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
    given = process.ServoOptions(run_dir=tmp_path, device=device, turn=0)
    nothing: Any = None
    with pytest.raises(process.DeviceError):
        process._play(nothing, nothing, given, nothing)
    assert order == (["opened"] if device == "simulated" else ["turn", "opened"])
