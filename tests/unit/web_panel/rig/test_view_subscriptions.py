"""Views' subscriptions, held only while somebody looks, from a session made of lists."""

from collections.abc import Callable
from typing import Any, cast

import pytest
import zenoh

from protocol.keys import Keys
from protocol.messages import Cost, Membrane, Message, Release, Spectrum, Strike
from rig_messages import strike
from web_panel.rig.rig_state import METER_LIFE_S, RigState
from web_panel.rig.view_subscriptions import COST, MEMBRANE, RELEASES, SPECTRUM, STRIKES, ViewSubscriptions

MEMBRANE_HEARD = Membrane(id="s", t_ns=0, rings=1, spokes=3, unit_m=1e-6, heights=bytes(8))
SPECTRUM_HEARD = Spectrum(id="s", t_ns=0, top_Hz=1e3, window_s=0.3, levels=bytes(8))
COST_HEARD = Cost(
    id="s", words="mesh", accuracy="now", mesh_rate_Hz=16000.0, across=66.7, share=1.0, cents=0.5
)


def contact(seq: int) -> tuple[Strike, Release]:
    return (
        strike(seq=seq, peak_estimate_N=5.0, impulse_N_s=0.01),
        Release(boot=1, seq=seq, t_ns=0, exit_speed_m_per_s=0.5, impulse_N_s=0.01, peak_N=5.0, contact_s=0.005),
    )  # fmt: skip


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
    session, rig_state, keys = Session(), RigState(), Keys("main")
    watching = ViewSubscriptions(cast(zenoh.Session, session), keys, rig_state, hand_on)

    def shown() -> object:
        return {MEMBRANE: rig_state.membrane, SPECTRUM: rig_state.spectrum, COST: rig_state.costs.get("now")}[
            name
        ]

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


def test_strikes_are_held_against_releases_while_somebody_looks_at_both() -> None:
    session, rig_state, keys = Session(), RigState(), Keys("main")
    watching = ViewSubscriptions(cast(zenoh.Session, session), keys, rig_state, hand_on)
    watching.want(frozenset({STRIKES, RELEASES}))
    for seq in range(3):
        strike, release = contact(seq)
        session.waiting[keys.release].append(release)
        watching.poll(1.0)  # before its strike
        session.waiting[keys.strike].append(strike)
        watching.poll(2.0)
    told = rig_state.announcements.report()
    assert told is not None
    assert (told.contacts, told.is_good) == (3, True)
    assert [at for at, _ in rig_state.new_releases] == [1.0, 1.0, 1.0]
    watching.want(frozenset({STRIKES}))
    assert rig_state.announcements.report() is None
