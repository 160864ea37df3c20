"""The gateway's look into the servo's block while the servo writes there."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink

ROLL = parse(shipped_text("roll"), "roll")


def test_a_tick_that_is_counted_meanwhile_waits_for_the_next_look(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the servo's own array numpy refuses, now and then: the bins in use changed while it counted them."""
    block = blocks.create(tmp_path, law_of(ROLL))
    link = ServoLink(tmp_path, law_of(ROLL))
    block.lateness[2] = 1
    find = np.flatnonzero

    def while_the_servo_counts(counts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        block.lateness[7] += 1
        return find(counts)

    monkeypatch.setattr(np, "flatnonzero", while_the_servo_counts)
    assert link.lateness()["ticks"] == [0, 0, 1]
    assert link.lateness()["ticks"] == [0, 0, 1, 0, 0, 0, 0, 1]
