"""A contact whose servo ends before it: the mirrors' gate falls and the note ends, whoever comes next."""

from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import pytest

from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.midi.sender import MidiSender
from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.settings import Parameters
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.records import EVENT, RELEASE, STRIKE
from osc_bench import FakeParameters
from protocol.messages import Choke, Release, Strike
from realtime.stop import StopRequest


@dataclass
class Ends:
    """A servo that has been replaced, and every wire; what they were given."""

    kinds: list[int]
    comes: bool = True  # another scene with the new servo
    boot: int = 7
    osc: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def take_events(self) -> np.ndarray:
        events = np.zeros(len(self.kinds), EVENT)
        events["kind"], events["t_ns"] = self.kinds, 1 << 62
        self.kinds = []
        return events

    def wake(self) -> None: ...

    def is_replaced(self) -> bool:
        return True

    def has_come(self) -> bool:
        return self.comes

    def look(self) -> str:
        return ""

    def refresh(self) -> bool:
        self.osc.append("new servo")
        return True

    def put_strike(self, strike: Strike) -> None:
        assert strike.boot == self.boot

    def put_release(self, release: Release) -> None:
        assert release.boot == self.boot

    def put_choke(self, choke: Choke) -> None:
        raise AssertionError(choke)


class Mirror:
    """The OSC server, or the MIDI port: the words of what it sent."""

    def __init__(self, sent: list[str]) -> None:
        self._sent = sent

    def strike(self, _strike: Strike) -> None:
        self._sent.append("on")

    def release(self, _release: object = None) -> None:
        self._sent.append("off")

    def end_gate(self) -> None:
        self._sent.append("off")


class Played:
    """Played strikes of which one is in contact."""

    def __init__(self) -> None:
        self.released = 0

    def begin(self, *_put: object) -> None: ...

    def release_all(self) -> None:
        self.released += 1


def relay_of(ends: Ends, played: Played | None = None) -> Relay:
    wires = Wires(
        cast(Wire, ends), cast(OscServer, Mirror(ends.osc)), midi=cast(MidiSender, Mirror(ends.notes)),
        played=cast(PlayedStrikes, played), ahead=cast(SceneAhead, ends),
    )  # fmt: skip
    return Relay("main", cast(ServoLink, ends), cast(Parameters, _Restarted()), wires)


class _Restarted(FakeParameters):
    def servo_restarted(self) -> None: ...


@pytest.mark.parametrize("kinds", [[STRIKE], [STRIKE, RELEASE], [STRIKE, RELEASE, STRIKE]])
def test_every_contact_is_ended_once_when_a_relay_ends(kinds: list[int]) -> None:
    ends, played, stop = Ends(kinds.copy()), Played(), StopRequest()
    stop.ask()
    relay_of(ends, played).run(stop)
    assert ends.osc == ends.notes == ["on", "off"] * kinds.count(STRIKE)
    assert played.released == 1


def test_a_servo_that_starts_anew_leaves_no_gate_at_1() -> None:
    ends: Any = Ends([STRIKE], comes=False)
    relay = relay_of(ends)
    relay._find_new_servo(0)
    assert ends.osc == ["on", "off", "new servo"]
    assert ends.notes == ["on", "off"]
