"""The gateway's look into the servo's block while the servo writes there."""

import threading
from pathlib import Path
from typing import cast

import numpy as np

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink

ROLL = parse(shipped_text("roll"), "roll")
ROUNDS = 20_000  # without the copy it was over after 1500


def test_the_histogram_is_read_while_bins_fill(tmp_path: Path) -> None:
    block = blocks.create(tmp_path, law_of(ROLL))
    link = ServoLink(tmp_path, law_of(ROLL))
    is_over = threading.Event()

    def count() -> None:
        while not is_over.is_set():
            np.bitwise_xor(block.lateness, 1, out=block.lateness)

    servo = threading.Thread(target=count)
    servo.start()
    try:
        for _ in range(ROUNDS):
            assert set(cast(list[int], link.lateness()["ticks"])) <= {0, 1}
    finally:
        is_over.set()
        servo.join()
