"""What a scene's own servo would stream: its simulated device in virtual time, as forces for the offline renderer."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from drumstick.drum.excitation.offline import Press
    from drumstick.parameters.scene import Scene

_AT_ONCE_TICKS = 1000


def presses(scene: "Scene", duration_s: float, gesture: str | None = None) -> "Iterator[Press]":
    """Its contacts up to duration_s from the first throw, oldest first. The scene streams.

    `gesture`: the text of its recorded gesture, checked, if it has one.
    """
    import numpy as np

    from drumstick.drum.excitation.offline import Press
    from drumstick.stick.law import law_of
    from haptic_server import block, contacts, files
    from haptic_server.device.simulated import Simulated
    from haptic_server.servo import loop, memory
    from realtime import ring
    from realtime.atomics import poke

    with tempfile.TemporaryDirectory() as folder:
        if gesture is not None:
            (Path(folder) / files.GESTURE).write_text(gesture, encoding="utf-8")
        device = Simulated(scene, Path(folder))
        device.open()
    specification = device.info().specification
    servo = device.furnish(memory.prepare(scene, block.in_memory(law_of(scene)), specification=specification))
    assert servo.stream is not None
    told = servo.stream.contacts
    poke(told.cells, contacts.LISTENED, 1)
    rate_Hz = scene.servo.rate_Hz
    samples = np.zeros(contacts.SLOTS, contacts.SAMPLE)
    left, now_ns = round(duration_s * rate_Hz), 0
    while left > 0:
        now_ns = loop.run_virtual(servo, min(left, _AT_ONCE_TICKS), now_ns)
        left -= _AT_ONCE_TICKS
        found = samples[: ring.drain(told.cells, told.slots, samples)]
        for seq in np.unique(found["seq"]):
            own = found[found["seq"] == seq]
            first = round(int(own["t_ns"][0]) * 1e-9 * rate_Hz)
            place = float(own["x"][0]), float(own["y"][0])
            yield Press(max(first, 0), float(rate_Hz), *place, own["force_N"].copy())
