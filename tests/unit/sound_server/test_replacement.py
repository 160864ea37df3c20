"""Pitch and decay that are set while the drum plays: another drum beside it takes its place, and nothing clicks."""

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.build import Unplayable
from drumstick.drum.calibrate import strike_for_speed
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.drum import Modal
from drumstick.parameters.scene import Scene
from protocol.clock import HapticClock
from protocol.messages import Contact, Meter, Readback, State, Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime.stop import StopRequest
from sound_server import drum as drums
from sound_server import replacement
from sound_server.drum import Drum
from sound_server.mixer import Mixer, mix

RATE, NOW, BLOCK = 48_000, 5_000_000_000, 128
MESH = Scene("low", drum=DrumOfScene(f01_Hz=150.0, t60_s=1.0))
SCENES = {"mesh": MESH, "modes": dataclasses.replace(MESH, modal=Modal(top_Hz=4000.0))}
STREAMED = dataclasses.replace(MESH, drum=dataclasses.replace(MESH.drum, excitation="streamed"))
Sound = npt.NDArray[np.float64]


class Sink:
    description = "nothing"
    load = latency_ms = 0.0
    xruns = 0
    lost = ""

    def __init__(self) -> None:
        self.rate_Hz = RATE
        self.mixer = Mixer(RATE)


class Link:
    """The rig: what its servo uses, and what the drum said of itself."""

    keys = publisher = None
    clock_pause_s = 1e9

    def __init__(self, scene: Scene) -> None:
        self.playing = scene
        self.values: dict[str, float] = {}
        self.revision = -1
        self.meters: list[Meter] = []

    def clock(self) -> HapticClock:
        return HapticClock(1, 0, 0)

    def scene(self, _parameters: str = "") -> Scene:
        return self.playing

    def subscribe_contacts(self, _take: object) -> None:
        pass

    def subscribe_params(self, _take: object) -> None:
        pass

    def params(self) -> dict[str, bytes]:
        values = {"listen.gain": 0.0} | self.values
        return {name: encode(Readback(value=value, revision=self.revision)) for name, value in values.items()}

    def publish(self, meter: Meter) -> None:
        self.meters.append(meter)


class Time:
    now_s = 0.0

    def monotonic(self) -> float:
        return self.now_s

    def monotonic_ns(self) -> int:
        return NOW


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Time:
    found = Time()
    monkeypatch.setattr(replacement, "time", found)
    return found


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[DrumOfScene]:
    """Drums that were built; one of 20 Hz cannot be."""
    found: list[DrumOfScene] = []
    build = drums.build

    def noted(scene: Scene, *given: Any) -> Any:
        found.append(scene.drum)
        if scene.drum.f01_Hz == 20.0:
            raise Unplayable("no wave fits")
        return build(scene, *given)

    monkeypatch.setattr(drums, "build", noted)
    return found


class Bench:
    """A drum that plays, whose rig sets it; `clock` moves with what is heard."""

    def __init__(self, clock: Time, scene: Scene = MESH) -> None:
        self.link, self.sink, self.clock, self.scene = Link(scene), Sink(), clock, scene
        link: Any = self.link
        sink: Any = self.sink
        self.drum = Drum(link, sink, "id", RateLimitedLog(lambda: 0), StopRequest())
        assert self.drum._catch_up()
        self.drum._next_clock = 1e9
        self.frames = self.seq = 0
        self.set()

    def set(self, **values: float) -> None:
        """The servo uses these values, by their wire names with _ for the dot, and says so."""
        self.link.revision += 1
        self.link.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        state = State(
            boot=1, t_ns=0, status="playing", z_m=0.0, v_m_per_s=0.0, force_N=0.0, x=0.0, y=0.0, roll_rate_Hz=0.0,
            v_e_m_per_s=0.0, strikes=0, ticks=0, overruns=0, lateness_p99_us=0.0, lateness_worst_us=0.0,
            ring_dropped=0, revision=self.link.revision, pending=False,
        )  # fmt: skip
        self.drum._heard_state(encode(state), 0)
        self.drum._turn()

    def strike(self) -> None:
        self.seq += 1
        blow = strike_for_speed(self.scene, 1.0, 0.3, 0.1)
        strike = Strike(
            boot=1, seq=self.seq, t_ns=NOW, x=blow.x, y=blow.y, z_speed_m_per_s=1.0, level=0.5,
            peak_estimate_N=blow.peak_N, contact_estimate_s=blow.contact_s, impulse_N_s=blow.impulse_N_s,
        )  # fmt: skip
        self.drum._strikes.take(encode(strike), NOW)

    def sound(self, seconds: float) -> Sound:
        out = np.zeros((round(seconds * RATE), 2), np.float32)
        for start in range(0, len(out), BLOCK):
            part = out[start : start + BLOCK]
            mix(self.sink.mixer.buffers, part, RATE, NOW + round(self.frames * 1e9 / RATE))
            self.frames += len(part)
        self.clock.now_s += seconds
        return out[:, 0].astype(float)

    @property
    def meter(self) -> Meter:
        return self.link.meters[-1]


def _pitch(sound: Sound) -> float:
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), 16 * len(sound)))
    return float(np.argmax(spectrum)) * RATE / (16 * len(sound))


def _decay_s(sound: Sound) -> float:
    halves = np.split(sound[: len(sound) // 2 * 2], 2)
    first, second = (float(np.sqrt(np.mean(half**2))) for half in halves)
    return 60.0 * len(sound) / 2 / RATE / (20.0 * np.log10(first / second))


def _rough(sound: Sound) -> float:
    # A click is a jump, in the sound or in its slope: the third difference shows it far above a drum's own.
    return float(np.abs(np.diff(sound, n=3)).max())


@pytest.mark.parametrize("kind", SCENES)
def test_the_next_strike_has_the_pitch_and_decay_that_were_set(clock: Time, kind: str) -> None:
    bench = Bench(clock, SCENES[kind])
    bench.strike()
    before = bench.sound(1.0)
    bench.set(drum_f01=190.0, drum_t60=0.5)
    bench.sound(1.0)
    bench.strike()
    after = bench.sound(1.0)
    found = [(_pitch(each[4800:24_000]), _decay_s(each[4800:24_000])) for each in (before, after)]
    assert [pitch for pitch, _ in found] == pytest.approx([150.0, 190.0], rel=0.01)
    assert [decay for _, decay in found] == pytest.approx([1.0, 0.5], rel=0.05)


def test_a_drum_in_whose_place_another_comes_rings_on_and_fades_without_a_click(clock: Time) -> None:
    changed, other = Bench(clock), Bench(clock)
    for bench in (changed, other):
        bench.strike()
        bench.sound(0.05)
    changed.set(drum_f01=190.0)
    ring, as_it_was = changed.sound(0.5), other.sound(0.5)
    assert np.array_equal(ring, as_it_was)
    faded = changed.sound(0.2)
    assert np.abs(faded[:480]).max() > 0.001
    assert not faded[-4800:].any()
    assert _rough(np.concatenate([ring[-4800:], faded])) <= 1.5 * _rough(as_it_was[-4800:])
    assert changed.sink.mixer.has_left(0)


def test_what_waits_is_told_until_it_sounds(clock: Time, built: list[DrumOfScene]) -> None:
    bench = Bench(clock)
    bench.set(listen_gain=-3.0)
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")
    bench.link.meters.clear()
    bench.set(drum_f01=190.0)
    told = [(meter.revision, meter.waiting) for meter in bench.link.meters]
    assert told == [(1, "building a drum of drum.f01 190"), (2, "")]
    assert [drum.f01_Hz for drum in built] == [150.0, 190.0]


def test_of_many_values_the_newest_counts_and_two_drums_are_the_most(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    for f01_Hz in range(160, 200):
        bench.set(drum_f01=float(f01_Hz))
        bench.sound(0.02)
        assert bench.sink.mixer.drums <= 2
    bench.sound(1.0)
    bench.drum._turn()
    assert (built[1].f01_Hz, built[-1].f01_Hz, len(built)) == (160.0, 199.0, 4)
    assert (bench.meter.revision, bench.meter.waiting) == (40, "")


def test_the_new_drum_is_as_loud_as_the_old_one_was_set_and_both_follow(clock: Time) -> None:
    bench, loud = Bench(clock), Bench(clock)
    bench.set(listen_gain=-20.0)
    for each in (bench, loud):
        each.set(drum_f01=190.0)
        each.strike()
    assert bench.sound(0.1) == pytest.approx(0.1 * loud.sound(0.1), abs=1e-6)
    loud.set(listen_mute=1.0)
    loud.sound(0.1)
    assert not loud.sound(0.1).any()


def test_a_drum_that_cannot_be_built_changes_nothing_and_is_told(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.set(drum_f01=20.0)
    bench.drum._turn()
    assert (bench.meter.revision, bench.meter.waiting) == (0, "no drum of drum.f01 20: no wave fits")
    assert len(built) == 2  # it is not tried again and again
    bench.strike()
    assert _pitch(bench.sound(0.5)) == pytest.approx(150.0, rel=0.02)
    bench.set(drum_f01=150.0)
    assert (bench.meter.revision, bench.meter.waiting) == (2, "")


def test_a_set_that_is_taken_back_while_its_drum_waits_builds_nothing_more(
    clock: Time, built: list[DrumOfScene]
) -> None:
    bench = Bench(clock)
    bench.set(drum_f01=160.0)
    bench.set(drum_f01=170.0)  # waits for the end of the first one
    bench.set(drum_f01=160.0)
    bench.sound(1.0)
    bench.drum._turn()
    assert [drum.f01_Hz for drum in built] == [150.0, 160.0]


def test_the_force_of_one_contact_goes_to_one_drum(clock: Time) -> None:
    bench = Bench(clock, STREAMED)

    def piece(first: int, *forces: float) -> None:
        given = np.array(forces, "<f4").tobytes()
        contact = Contact(boot=1, seq=1, first_tick=first, rate_Hz=1000.0, forces=given, x=0.3, y=0.1)
        bench.drum._contacts.take(encode(contact), NOW)

    piece(0, 1.0, 2.0)
    bench.set(drum_f01=190.0)
    assert bench.sink.mixer.drums == 1
    assert (bench.meter.revision, bench.meter.waiting) == (0, "building a drum of drum.f01 190")
    piece(2, 1.0, 0.0)
    bench.drum._turn()
    assert bench.sink.mixer.drums == 2
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")


def test_a_full_mixer_is_asked_again(clock: Time) -> None:
    bench = Bench(clock)
    mixer = bench.sink.mixer
    assert bench.drum._engine is not None
    others = [mixer.enter(bench.drum._engine) for _ in range(15)]
    bench.set(drum_f01=190.0)
    assert "16 drums sound already" in bench.meter.waiting
    mixer.leave(others[0])
    bench.sound(1.1)
    bench.drum._turn()
    assert (bench.meter.revision, bench.meter.waiting) == (1, "")
