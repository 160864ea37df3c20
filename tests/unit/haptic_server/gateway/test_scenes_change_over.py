"""A gateway between two scenes: the relay of the one before has ended, that of the next has not begun."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway import process
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.settings import Parameters
from protocol.messages import Release, Strike
from realtime.notify import Supervisor
from realtime.stop import StopRequest

ROLL = parse(shipped_text("roll"), "roll")


class Anything:
    """Takes every call, and has every attribute, that nothing here asks about."""

    def __getattr__(self, _name: str) -> "Anything":
        return Anything()

    def __call__(self, *_: object) -> "Anything":
        return Anything()


def test_a_played_strike_that_comes_between_two_scenes_has_its_release(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block = blocks.create(tmp_path, law_of(ROLL))
    strikes: list[Strike] = []
    releases: list[Release] = []

    def playing() -> Any:
        parameters = Parameters(ROLL, ServoLink(tmp_path, law_of(ROLL)))
        return SimpleNamespace(
            parameters=parameters, played=PlayedStrikes(ROLL.strike, parameters), scene=ROLL, json="{}",
            link=Anything(), presets=Anything(), requests=Anything(), rolls=Anything(),
        )  # fmt: skip

    first, stop = playing(), StopRequest()

    def relay(_gateway: object, _session: object, relayed: Any, *_: object) -> None:
        if relayed is first:
            first.played.begin(strikes.append, releases.append, Anything())
        else:
            stop.ask()

    def next_one(*_: object) -> Any:
        first.played.play(0.0, 0.0, 0.5, "test")
        assert not releases
        return playing()

    for name in ("Wire", "PlayQueries", "RollQueries", "Pointing"):
        monkeypatch.setattr(process, name, lambda *_: Anything())
    monkeypatch.setattr(process, "_playing", next_one)
    monkeypatch.setattr(process._Gateway, "_open_osc", lambda _: (Anything(), Anything()))
    monkeypatch.setattr(process._Gateway, "_relay", relay)
    given = GatewayOptions(run_dir=tmp_path, state_dir=tmp_path, fresh=True)
    process._Gateway(given, first, Supervisor(), stop)._play_on(cast(Any, Anything()))
    assert [release.seq for release in releases] == [strike.seq for strike in strikes] == [1]
    del block  # kept until here: the mapping lives as long as its views
