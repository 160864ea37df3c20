"""The driver's thread: found by its number, favoured where that is allowed, and no harm done where it is gone."""

import os
import subprocess
import sys
import threading

import pytest

from haptic_server.servo.device.openhaptics.thread import own_id, request_real_time

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux numbers its threads")


def test_compiled_code_knows_its_own_thread() -> None:
    assert own_id() == threading.get_native_id()


def test_a_thread_that_has_ended_is_no_error() -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert request_real_time(child.pid) == "the driver's servo thread has ended already"


def test_no_number_is_said() -> None:
    assert "not known" in request_real_time(0)


def test_what_is_refused_says_what_to_raise(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_getscheduler", lambda _: os.SCHED_OTHER)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert request_real_time(own_id()).endswith("Operation not permitted (raise the rtprio limit)")


def test_a_thread_that_runs_in_real_time_is_left_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getscheduler", lambda _: os.SCHED_RR)
    monkeypatch.setattr(os, "sched_getparam", lambda _: os.sched_param(55))
    assert request_real_time(own_id()) == "the driver's servo thread runs under SCHED_RR 55"
