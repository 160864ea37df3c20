"""The sound of a streamed roll, live and rendered offline: the same samples, in virtual time.

Live: the scene's servo, the gateway's pieces, their payloads, a network that jitters, the sound server's scheduler and
mixer, block by block. Offline: what `drumstick render --roll` writes. The two may differ by what is rounded on the way:
instants to whole ns (the haptic clock, the start of each block), which moves each contact by at most 2 ns. At the top
of what the mesh plays that is 2 pi 8 kHz 2 ns = 1e-4 of it; a difference of 1e-4 of the peak is allowed (-80 dB).
"""

import re

import numpy as np
import numpy.typing as npt
import pytest

import sampled_arm
from drumstick.drum.calibrate import build
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_gesture
from haptic_server.contacts import SAMPLE, SLOTS
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from haptic_server.servo import loop
from protocol.clock import HapticClock
from protocol.messages import encode
from protocol.rate_limited_log import RateLimitedLog
from realtime import ring
from rig.offline.streamed_roll import presses, servo_of
from sound_server.mixer import Mixer, mix
from sound_server.receiving.contacts import ContactScheduler
from streamed_engine import MS, STREAMS, streamed_text

Sound = npt.NDArray[np.float32]
RATE_HZ = 48_000
BLOCK = 128
BOOT = 9
BEGIN_NS = 1_000_000_000  # when the servo starts, by the sound server's clock
SECONDS = 2.0
PLAYED_S = SECONDS + 0.01  # a contact may last beyond what is heard
MAX_DIFFERENCE = 1e-4  # of the peak


def wire(scene: Scene, gesture: str | None, start_ns: int) -> list[tuple[int, bytes]]:
    """Payloads and when they arrive, by the sound server's clock, of a servo that starts at start_ns by its own."""
    servo = servo_of(scene, gesture)
    assert servo.stream is not None
    told, samples = servo.stream.contacts, np.zeros(SLOTS, SAMPLE)
    pieces, random = Pieces(float(scene.servo.rate_Hz)), np.random.default_rng(2)
    now_ns, found = start_ns, list[tuple[int, bytes]]()
    for _ in range(round(PLAYED_S * scene.servo.rate_Hz)):
        now_ns = loop.run_virtual(servo, 1, now_ns)
        count = ring.drain(told.cells, told.slots, samples)
        for piece in pieces.of(BOOT, samples[:count], now_ns):
            found.append((BEGIN_NS + now_ns - start_ns + int(random.integers(100_000, MS)), encode(piece)))
    return sorted(found)


def live(scene: Scene, gesture: str | None, start_ns: int) -> tuple[Sound, ContactScheduler]:
    """Sound that the server plays from the instant on at which the servo's start is heard."""
    mixer = Mixer(RATE_HZ)
    engine = build(fitted(scene, RATE_HZ).scene, RATE_HZ, StrikeRing())
    mixer.enter(engine)
    scheduler = ContactScheduler(RateLimitedLog(lambda: 0), lambda _boot: None)
    scheduler.clock = HapticClock(BOOT, start_ns - BEGIN_NS, 0)
    scheduler.play_on(engine.stream, scene.drum.latency_s)
    out = np.zeros((round(SECONDS * RATE_HZ), 2), np.float32)
    # A block of silence tells the scheduler how long blocks are. Then the mesh steps with the ticks, as offline.
    mix(mixer.buffers, out[:BLOCK], RATE_HZ, 0)
    delay_ns = round(scheduler.delay_s * 1e9)
    divisor = int(engine.control["divisor"][0])
    mix(mixer.buffers, out[: -BLOCK % divisor], RATE_HZ, 0)
    first_ns, messages = BEGIN_NS + delay_ns, wire(scene, gesture, start_ns)
    for start in range(0, len(out), BLOCK):
        now_ns = first_ns + int(start * 1e9 / RATE_HZ)
        while messages and messages[0][0] <= now_ns:
            arrival_ns, payload = messages.pop(0)
            scheduler.take(payload, arrival_ns)
        mix(mixer.buffers, out[start : start + BLOCK], RATE_HZ, now_ns)
    return out, scheduler


# When the servo starts, by its own clock. Offline that is 0; an arm's encoders give other steps at other times, as the
# hand's path is rounded otherwise, so the same take needs the same clock.
CASES = {
    "paper-roll": 78_000_000_123,
    "roll": 5_000_000_000,
    "accents": 0,
    "dead strokes": 5_000_000_000,
    "presses": 0,
}
# The stick falls into the head and lies there until it is thrown again; an arm is pressed into it and lifted.
LONG = {
    "dead strokes": re.sub(r"\[effects\.pulse\][^[]*", "", streamed_text("roll")),
    "presses": f"[drum]\n{STREAMS}\n{sampled_arm.SCENE.format(gesture='press', device='', guard='')}",
}


@pytest.mark.parametrize("name", CASES)
def test_a_roll_sounds_live_as_it_is_rendered(name: str) -> None:
    scene = parse(LONG.get(name) or streamed_text(name), name)
    gesture = shipped_gesture(scene.hand.gesture_file) if scene.hand.gesture_file else None
    heard, scheduler = live(scene, gesture, CASES[name])
    rendered = render(scene, [], SECONDS, RATE_HZ, presses(scene, PLAYED_S, gesture))
    assert scheduler.played >= 4
    assert scheduler.late == scheduler.refused == scheduler.duplicates == scheduler.underflows == 0
    peak = float(np.abs(rendered).max())
    assert peak > 0.05
    assert np.abs(heard - rendered).max() < MAX_DIFFERENCE * peak
