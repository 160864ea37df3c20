"""Another scene's drum: built beside the one that sounds, entered when its servo speaks; the old one rings on."""

from typing import Any

import numpy as np
import pytest

from drumstick.drum.build import Unplayable
from drumstick.drum.calibrate import build
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.scene import Scene
from playing_drum import NOW, RATE, Link, Sink, drum_of
from protocol.messages import encode
from rig_messages import strike
from sound_server import drum as drums
from sound_server.mixer import SLOTS, mix

MESH, HIGH = (Scene(name, drum=DrumOfScene(f01_Hz=f01)) for name, f01 in (("low", 120.0), ("high", 200.0)))


class Bench:
    """A drum that plays `low`, and whose rig makes `high` ready."""

    def __init__(self) -> None:
        self.link, self.sink = Link(MESH, HIGH), Sink()
        self.drum = drum_of(self.link, self.sink)
        assert self.drum._catch_up()
        self.now_ns = NOW

    def hand_over(self) -> None:
        self.link.playing, self.link.boot = HIGH, 2
        assert self.drum._catch_up()

    def strike(self) -> None:
        struck = strike(
            boot=self.link.boot, t_ns=self.now_ns, x=0.3, y=0.1, z_speed_m_per_s=0.6, peak_estimate_N=2.0,
            contact_estimate_s=0.004,
        )  # fmt: skip
        self.drum._strikes.take(encode(struck), self.now_ns)

    def sound(self, seconds: float) -> np.ndarray:
        out = np.zeros((round(seconds * RATE), 2), np.float32)
        mix(self.sink.mixer.buffers, out, RATE, self.now_ns)
        self.now_ns += round(seconds * 1e9)
        return out


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the drums that were built."""
    names: list[str] = []
    build = drums.build

    def noted(scene: Scene, *given: Any) -> Any:
        names.append(scene.name)
        if scene.name == "none":
            raise Unplayable("no wave fits")
        return build(scene, *given)

    monkeypatch.setattr(drums, "build", noted)
    return names


def test_the_next_drum_is_built_once_and_only_enters_with_its_servo(made: list[str]) -> None:
    bench = Bench()
    bench.drum._make_ahead("high")
    assert made == ["low", "high"]
    assert bench.sink.mixer.drums == 1
    bench.drum._make_ahead("")  # the next scene's folder goes before its servo is heard
    bench.hand_over()
    assert made == ["low", "high"]
    assert bench.sink.mixer.drums == 2


def test_the_old_drum_rings_on_as_if_nothing_had_changed(made: list[str]) -> None:
    changed, other = Bench(), Bench()
    for bench in (changed, other):
        bench.strike()
        bench.sound(0.1)
    changed.drum._make_ahead("high")
    changed.hand_over()
    ring = changed.sound(0.5)
    assert np.array_equal(ring, other.sound(0.5))
    assert np.abs(ring).max() > 0.0
    changed.strike()  # on the new drum, beside it
    assert not np.array_equal(changed.sound(0.1), other.sound(0.1))
    for _ in range(10):
        changed.sound(0.2)
    assert changed.sink.mixer.has_left(0)
    assert made.count("high") == 1


def test_a_drum_that_cannot_be_built_leaves_the_present_one_as_it_is(made: list[str]) -> None:
    bench = Bench()
    bench.link.ahead = Scene("none")
    bench.drum._make_ahead("none")
    assert made == ["low", "none"]
    bench.strike()
    assert np.abs(bench.sound(0.1)).max() > 0.0


def test_a_full_mixer_is_asked_again_and_the_drum_is_built_once(made: list[str]) -> None:
    """Drums that were replaced ring on for half a second: a change of scene waits for them, and ends no thread."""
    bench = Bench()
    others = [bench.sink.mixer.enter(build(MESH, RATE, StrikeRing())) for _ in range(SLOTS - 1)]
    bench.link.playing, bench.link.boot = HIGH, 2
    assert not bench.drum._catch_up()
    assert not bench.drum._catch_up()
    bench.sink.mixer.leave(others[0])
    while not bench.sink.mixer.has_left(others[0]):
        bench.sound(0.1)
    assert bench.drum._catch_up()
    assert made == ["low", "high"]
