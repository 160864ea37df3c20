"""What is heard only while somebody looks, from a session made of lists."""

from collections.abc import Callable
from typing import Any, cast

import pytest
import zenoh

from protocol.keys import Keys
from protocol.messages import Cost, Membrane, Message, Spectrum
from web_panel.rig.mirror import METER_LIFE_S, Mirror
from web_panel.rig.watching import COST, MEMBRANE, SPECTRUM, Watching

MEMBRANE_HEARD = Membrane(id="s", t_ns=0, rings=1, spokes=3, unit_m=1e-6, heights=bytes(8))
SPECTRUM_HEARD = Spectrum(id="s", t_ns=0, top_Hz=1e3, window_s=0.3, levels=bytes(8))
COST_HEARD = Cost(
    id="s", words="mesh", accuracy="now", mesh_rate_Hz=16000.0, across=66.7, share=1.0, cents=0.5
)


class Session:
    """Subscribers that give what is waiting under their key."""

    def __init__(self) -> None:
        self.waiting: dict[str, list[Message]] = {}

    def declare_subscriber(self, key: str, _: object) -> "Subscriber":
        return Subscriber(self.waiting.setdefault(key, []))


class Subscriber:
    def __init__(self, waiting: list[Message]) -> None:
        self._waiting = waiting

    def try_recv(self) -> Message | None:
        return self._waiting.pop(0) if self._waiting else None

    def undeclare(self) -> None:
        pass


def hand_on(sample: Any, _: object, note: Callable[[str, Any], None]) -> bool:
    note("", sample)
    return True


@pytest.mark.parametrize(
    ("name", "message"), [(MEMBRANE, MEMBRANE_HEARD), (SPECTRUM, SPECTRUM_HEARD), (COST, COST_HEARD)]
)
def test_what_a_sound_server_said_last_is_forgotten_when_it_says_no_more(name: str, message: Message) -> None:
    session, mirror, keys = Session(), Mirror(), Keys("main")
    watching = Watching(cast(zenoh.Session, session), keys, mirror, hand_on)

    def shown() -> object:
        return {MEMBRANE: mirror.membrane, SPECTRUM: mirror.spectrum, COST: mirror.costs.get("now")}[name]

    watching.want(frozenset({name}))
    (waiting,) = session.waiting.values()
    waiting.append(message)
    watching.poll(10.0)
    assert shown() is message
    watching.poll(10.0 + 0.9 * METER_LIFE_S)
    assert shown() is message
    watching.poll(10.0 + 1.1 * METER_LIFE_S)
    assert shown() is None
    waiting.append(message)
    watching.poll(20.0)
    assert shown() is message
    watching.want(frozenset())
    assert shown() is None
