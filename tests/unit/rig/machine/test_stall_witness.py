"""Witnesses of stalls where there can be none."""

import os
import sys

import pytest

from rig.machine.stall_witness import StallWitnesses


def test_another_system_has_no_witnesses_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    with StallWitnesses() as witnesses:
        assert witnesses.refused == ["witnesses run only on Linux, this is darwin"]
    assert witnesses.stalls().shape == (0, 2)
