"""Files that the servo's process writes beside its tick: a full disk takes none of it down."""

import errno
import logging
import os
from pathlib import Path

import pytest

import sampled_arm
from haptic_server.records import FAULT_WORDS, NO_FAULT, STALLED
from haptic_server.servo import loop, process


@pytest.fixture
def full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file on a disk that takes not a byte."""

    def refuse(path: Path, text: str) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(process, "write_text", refuse)
    return tmp_path / "full"


@pytest.fixture
def unread(tmp_path: Path) -> Path:
    """A pipe that nobody reads."""
    os.mkfifo(tmp_path / "unread")
    return tmp_path / "unread"


@pytest.mark.parametrize(("where", "why"), [("full", "No space left"), ("unread", "not a regular file")])
def test_a_fault_that_cannot_be_kept_is_told_and_the_servo_goes_on(
    where: str, why: str, request: pytest.FixtureRequest, caplog: pytest.LogCaptureFixture
) -> None:
    path: Path = request.getfixturevalue(where)
    servo = sampled_arm.servo_of(sampled_arm.scene("strokes"))
    now = loop.run_virtual(servo, 100, 0) + 30_000_000
    loop.traced_tick(servo, now, 0.03)
    with caplog.at_level(logging.ERROR):
        process._save_trace(servo, path)  # pyright: ignore[reportPrivateUsage]
    assert FAULT_WORDS[STALLED] in caplog.text
    assert f"{path} cannot be written: {why}" in caplog.text
    servo.tick_state["fault"] = NO_FAULT
    loop.run_virtual(servo, 100, now)
    assert servo.tick_state[0]["traced"] == 201


def test_what_the_system_granted_is_not_worth_a_fault(full: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        process._write_granted(full, {"scheduler": "SCHED_FIFO 80"})  # pyright: ignore[reportPrivateUsage]
    assert f"{full} cannot be written: No space left" in caplog.text


def test_the_present_fault_is_written_once_and_the_next_one_too(tmp_path: Path) -> None:
    servo = sampled_arm.servo_of(sampled_arm.scene("strokes"))
    path = tmp_path / "trace.csv"
    sizes: list[int] = []
    now = 0
    for _ in range(2):
        now = loop.run_virtual(servo, 100, now) + 30_000_000
        loop.traced_tick(servo, now, 0.03)
        assert servo.tick_state[0]["fault"] == STALLED
        process._save_trace(servo, path)  # pyright: ignore[reportPrivateUsage]
        sizes.append(len(path.read_text().splitlines()) - 1)
        servo.tick_state["fault"] = NO_FAULT
    assert sizes == [101, 202]
