"""Readbacks of the drum's live values: the newest counts, and what cannot be is told and changes nothing."""

import dataclasses
import logging
import math

import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.scene import Scene
from protocol.messages import Readback, encode
from protocol.rate_limited_log import RateLimitedLog
from sound_server.receiving.live_values import LiveValues


def _scene(press: float = 1.0) -> Scene:
    scene = Scene("muffled")
    drum = dataclasses.replace(scene.drum, f01_Hz=1000.0, effects={"muffle": MuffleTable(press=press)})
    return dataclasses.replace(scene, drum=drum)


class Played:
    """An engine, and who changes it."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.values = LiveValues(RateLimitedLog(self._later))
        self.engine = self.another(1.0)

    def _later(self) -> int:
        self.now_ns += 3_600_000_000_000  # so late that the log is not limited
        return self.now_ns

    def another(self, press: float) -> Engine:
        self.engine = new_engine(_scene(press), 48_000, StrikeRing())
        self.values.play_on(_scene(press), self.engine)
        return self.engine

    def tell(self, value: float, revision: int, name: str = "muffle") -> float:
        self.values.take(name, encode(Readback(value=value, revision=revision)))
        return self.target

    @property
    def target(self) -> float:
        return float(self.engine.effects.muffle.target["muffle"][0])


@pytest.fixture
def played() -> Played:
    return Played()


def test_the_newest_counts_whichever_comes_last(played: Played) -> None:
    assert played.tell(0.5, 3) == 0.5
    assert played.tell(0.2, 2) == 0.5  # overtaken
    assert played.tell(0.3, 3) == 0.3  # a servo refused what followed, or said it again
    assert played.tell(0.9, 4) == 0.9


def test_revisions_count_from_a_servos_start_and_from_a_scenes(played: Played) -> None:
    played.tell(0.5, 30)
    played.values.begin_anew()
    assert played.tell(0.2, 1) == 0.2
    played.another(0.7)
    assert played.target == 0.7
    assert played.tell(0.1, 0) == 0.1


@pytest.mark.parametrize("value", [-0.01, 1.5, math.nan, math.inf])
def test_a_value_beyond_its_range_changes_nothing_and_is_told(
    played: Played, value: float, caplog: pytest.LogCaptureFixture
) -> None:
    played.tell(0.5, 3)
    with caplog.at_level(logging.WARNING):
        assert played.tell(value, 9) == 0.5
    assert "muffle ignored: " in caplog.text
    assert played.tell(0.6, 4) == 0.6  # what it called itself does not count either


@pytest.mark.parametrize("payload", [b"", b"\x00", b"\x93\x01\xa1x\x01", b"\xff" * 40])
def test_bytes_that_are_no_readback_change_nothing_and_are_told(
    played: Played, payload: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        played.values.take("muffle", payload)
    assert "muffle ignored: " in caplog.text
    assert played.target == 1.0


def test_how_it_is_listened_to_goes_the_same_way(played: Played) -> None:
    played.tell(-7.0, 3, "listen.gain")
    assert float(played.engine.listening.target["listen_gain"][0]) == -7.0
    assert played.target == 1.0


def test_what_the_drum_does_not_have_changes_nothing(played: Played) -> None:
    assert played.tell(0.1, 5, "dv_pls") == 1.0
