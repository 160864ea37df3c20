"""The relay's rounds: as seldom as the state goes out, unless something else may be due or can only be found."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway import event_wait
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.settings import Parameters
from haptic_server.records import EVENT, RELEASE, STRIKE
from realtime import ring

ROLL = parse(shipped_text("roll"), "roll")
MS = 1_000_000


@dataclass
class Bench:
    """Stands in for the link, the Zenoh wire and what is played; when a release is due."""

    holds_back: bool = False
    is_pointed: bool = False
    release_ns: int = 0

    def wake(self) -> None: ...

    def begin(self, *_put: object) -> None: ...

    def put_choke(self) -> None: ...

    def due_ns(self, otherwise: int) -> int:
        return self.release_ns or otherwise


def relay_of(bench: Bench, **parts: Any) -> Relay:
    each = cast(Any, bench)
    relay: Any = Relay("test", each, each, Wires(each, each, played=each, **parts))
    relay._next_state_ns = 30 * MS
    return cast(Relay, relay)


@pytest.mark.parametrize(
    ("bench", "parts", "due_ms"),
    [
        (Bench(), {}, 30),
        (Bench(holds_back=True), {}, 3),
        (Bench(is_pointed=True), {}, 3),
        (Bench(), {"contacts": object()}, 3),
        (Bench(release_ns=7 * MS), {}, 7),
        (Bench(release_ns=70 * MS), {}, 30),
    ],
)
def test_the_next_round(bench: Bench, parts: dict[str, object], due_ms: int) -> None:
    assert relay_of(bench, **parts).next_round_ns(MS) == due_ms * MS


def test_a_played_strike_wakes_the_relay_when_its_release_is_known(tmp_path: Path) -> None:
    blocks.create(tmp_path, law_of(ROLL))
    link = ServoLink(tmp_path, law_of(ROLL))
    played = PlayedStrikes(ROLL.strike, Parameters(ROLL, link), lambda: MS)
    due: list[int] = []
    put: list[object] = []
    played.begin(put.append, put.append, put.append, lambda: due.append(played.due_ns(0)))
    assert played.due_ns(5) == 5
    strike = played.play(0.3, 0.0, 0.5, "test")
    assert due == [strike.t_ns + round(strike.contact_estimate_s * 1e9)]


def test_whoever_wakes_the_link_ends_its_wait_once(tmp_path: Path) -> None:
    blocks.create(tmp_path, law_of(ROLL))
    link = ServoLink(tmp_path, law_of(ROLL))
    link.wake()
    assert link.await_events(10**18) == 0
    assert link.await_events(0) == 0


def test_the_wait_knows_whether_a_strike_has_no_release_yet(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = blocks.create(tmp_path, law_of(ROLL))
    link = ServoLink(tmp_path, law_of(ROLL))
    given: list[bool] = []
    monkeypatch.setattr(event_wait, "await_events", lambda *arguments: given.append(arguments[-1]))
    event = np.zeros(1, EVENT)
    for kinds in ((), (STRIKE,), (), (RELEASE, STRIKE), (RELEASE,), ()):
        for kind in kinds:
            event["kind"] = kind
            ring.push(block.ring_cells, block.events, event[0])
        link.take_events()
        link.await_events(0)
    assert given == [False, True, True, True, False, False]
