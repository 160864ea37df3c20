"""Probes of stalls where there can be none."""

import os
import sys

import pytest

from haptic_server.servo.stall_detector import StallDetector


def test_another_system_has_no_probes_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    with StallDetector() as probes:
        assert probes.refused == ["witnesses run only on Linux, this is darwin"]
    assert probes.stalls().shape == (0, 2)
