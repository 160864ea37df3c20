"""The level of a strike, live: the servo's curve in virtual time, and what OSC, MIDI and Zenoh make of it."""

import json
from typing import Any, cast

import numpy as np
import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick.stick.strike_curve import level_at
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.midi.encoding import velocity
from haptic_server.gateway.midi.sender import MidiSender
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.settings import Parameters
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.records import EVENT, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from osc_bench import FakeParameters, client, opened_front
from protocol.messages import Strike
from realtime import ring
from realtime.kernels.jit import allocations
from rig.offline.simulate import simulate as print_contacts

CURVES = {
    "linear": "full_scale_m_per_s = 1.3",
    "log": 'curve = "log"\nfull_scale_m_per_s = 1.3\nsoftest_m_per_s = 0.02',
    "table": 'curve = "table"\ntable = [[0.02, 0.1], [0.2, 0.6], [1.3, 0.9]]',
}


class Outlets:
    """Stands in for the block's reader, the Zenoh wire and the MIDI port: it keeps the strikes."""

    boot = 7

    def __init__(self, events: np.ndarray) -> None:
        self._events = events
        self.strikes: list[Strike] = []
        self.notes: list[int] = []

    def take_events(self) -> np.ndarray:
        return self._events

    def take_live(self) -> None:
        return None

    def put_strike(self, strike: Strike) -> None:
        self.strikes.append(strike)

    def step(self, now_ns: int) -> None:
        pass

    def strike(self, strike: Strike) -> None:
        self.notes.append(velocity(strike.level))


def scene_of(name: str) -> Scene:
    return parse(f"{shipped_text('bare-drum')}\n[strike]\n{CURVES[name]}\n", "bare-drum")


def struck(scene: Scene) -> np.ndarray:
    """Strikes of the scene's stick in a second of virtual time."""
    servo = memory.prepare(scene, blocks.in_memory(law_of(scene)))
    start = allocations()
    now_ns = loop.run_virtual(servo, 1, 0)
    one = allocations()
    loop.run_virtual(servo, 1000, now_ns)
    assert allocations() - one == one - start  # what the call from Python costs, whatever the number of ticks
    out = np.zeros(blocks.RING_SLOTS, EVENT)
    events = out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]
    return events[events["kind"] == STRIKE]


@pytest.mark.parametrize("name", CURVES)
def test_every_outlet_has_the_servos_level(name: str) -> None:
    scene = scene_of(name)
    strikes = struck(scene)[:8]
    assert len(np.unique(strikes["level"])) >= 5
    levels = strikes["level"].tolist()
    assert levels == [level_at(scene.strike, float(speed)) for speed in strikes["speed_m_per_s"]]
    outlets = Outlets(strikes)
    with client() as heard, opened_front(FakeParameters(), heard) as front:
        relay = Relay(
            "main",
            cast(ServoLink, outlets),
            cast(Parameters, None),
            Wires(cast(Wire, outlets), front, midi=cast(MidiSender, outlets)),
        )
        relay.step(-1)
        told = heard.waiting()
    assert [strike.level for strike in outlets.strikes] == levels
    assert outlets.notes == [1 + round(126.0 * level) for level in levels]
    by_osc = np.float32(levels).tolist()
    assert [values[4] for address, values in told if address == "/drumstick/strike"] == by_osc
    assert [values[0] for address, values in told if address == "/drumstick/level"] == by_osc


@pytest.mark.parametrize("name", CURVES)
def test_offline_contacts_have_the_live_level(
    name: str, tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = scene_of(name)
    path = tmp_path / "mine.toml"
    path.write_text(f"{shipped_text('bare-drum')}\n[strike]\n{CURVES[name]}\n", encoding="utf-8")
    print_contacts(str(path), 1.0, scene.hand.throw_m_per_s, "exact", None, True, True)
    contacts = json.loads(capsys.readouterr().out)["contacts"]
    live = struck(scene)["level"][: len(contacts)]
    assert len(live) >= 5
    np.testing.assert_allclose([each["level"] for each in contacts[: len(live)]], live, rtol=1e-9)
