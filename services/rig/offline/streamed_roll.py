"""Forces that a scene's servo would stream, from its simulated device in virtual time, for the offline renderer.

The forces come by the messages that the gateway would send, so that what is rendered is what the wire carries, rounding
and places included.
"""

import itertools
from typing import TYPE_CHECKING

from realtime.records import is_there

if TYPE_CHECKING:
    from collections.abc import Iterator

    from drumstick.drum.excitation.offline import StreamedContact
    from drumstick.parameters.scene import Scene
    from haptic_server.servo.force.memory import Servo
    from protocol.messages import Contact

_AT_ONCE_TICKS = 30  # a buzz of 65 contacts in each still finds room in the ring
_BOOT = 1
_END_NS = 2**62  # later than any tick


def servo_of(scene: "Scene", gesture: str | None = None) -> "Servo":
    """The scene's servo with its simulated device and somebody who listens, for virtual time. The scene streams.

    `gesture`: the text of its recorded gesture, checked, if it has one.
    """
    from haptic_server.contacts import LISTENED
    from haptic_server.servo import offline
    from realtime.atomics import poke

    servo = offline.servo_of(scene, gesture)
    assert is_there(servo.stream)
    poke(servo.stream.contacts.cells, LISTENED, 1)
    return servo


def contacts(scene: "Scene", duration_s: float, gesture: str | None = None) -> "Iterator[Contact]":
    """Contacts that the gateway would publish up to duration_s from the first throw, oldest first. Arguments: see
    servo_of.
    """
    import numpy as np

    from haptic_server.contacts import SAMPLE, SLOTS
    from haptic_server.gateway.zenoh.contact_pieces import Pieces
    from haptic_server.servo import loop
    from realtime import ring

    servo = servo_of(scene, gesture)
    assert is_there(servo.stream)
    contact_ring, rate_Hz = servo.stream.contacts, scene.servo.rate_Hz
    pieces, samples = Pieces(float(rate_Hz)), np.zeros(SLOTS, SAMPLE)
    left, now_ns = round(duration_s * rate_Hz), 0
    while left > 0:
        now_ns = loop.run_virtual(servo, min(left, _AT_ONCE_TICKS), now_ns)
        left -= _AT_ONCE_TICKS
        # At time 0 no sample is old and no piece has waited: each goes when it is full or closed.
        yield from pieces.of(_BOOT, samples[: ring.drain(contact_ring.cells, contact_ring.slots, samples)], 0)
    yield from pieces.of(_BOOT, (), _END_NS)


def presses(scene: "Scene", duration_s: float, gesture: str | None = None) -> "Iterator[StreamedContact]":
    """Forces of `contacts` for the offline renderer, a press for each contact."""
    import numpy as np

    from drumstick.drum.excitation.offline import StreamedContact

    zeroth: int | None = None
    for _, pieces in itertools.groupby(contacts(scene, duration_s, gesture), lambda piece: piece.seq):
        own = list(pieces)
        first_tick, rate_Hz, t_ns, x, y = own[0].first_tick, own[0].rate_Hz, own[0].t_ns, own[0].x, own[0].y
        assert t_ns is not None
        assert x is not None
        assert y is not None
        if zeroth is None:
            zeroth = first_tick - round(t_ns * 1e-9 * rate_Hz)
        forces_N = np.frombuffer(b"".join(piece.forces for piece in own), "<f4").astype(np.float64)
        yield StreamedContact(max(first_tick - zeroth, 0), rate_Hz, x, y, forces_N)
