"""A sound server's drum in virtual time: its rig is paper, its clock moves with what is heard."""

import dataclasses
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.build import Unplayable
from drumstick.drum.calibrate import strike_for_speed
from drumstick.parameters.drum import Drum as DrumOfScene
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import MATERIALS, Mallet
from drumstick.parameters.scene import Scene
from protocol.clock import HapticClock
from protocol.messages import Choke, Contact, Meter, Readback, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime.stop import StopRequest
from rig_messages import state, strike
from sound_server.drum import Drum
from sound_server.mixer import Mixer, mix
from sound_server.output_trim import OutputTrim

RATE, NOW, BLOCK = 48_000, 5_000_000_000, 128
MESH = Scene("low", drum=DrumOfScene(f01_Hz=150.0, t60_s=1.0))
SCENES = {"mesh": MESH, "modes": dataclasses.replace(MESH, modal=Modal(top_Hz=4000.0))}
STREAMED = dataclasses.replace(MESH, drum=dataclasses.replace(MESH.drum, excitation="streamed"))
STRUCK = dataclasses.replace(
    MESH, drum=dataclasses.replace(MESH.drum, excitation="mallet"), mallet=Mallet(**MATERIALS["felt"])
)
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
    """The rig: the scene that its servo plays, the next one and what was set; and what the drum said of itself."""

    keys = publisher = None
    clock_pause_s = 1e9

    def __init__(self, scene: Scene, ahead: Scene | None = None, boot: int = 1, offset_ns: int = 0) -> None:
        self.playing, self.ahead, self.boot, self.answers = scene, ahead, boot, True
        self._offset_ns = offset_ns
        self.values: dict[str, float] = {}
        self.revision = -1
        self.meters: list[Meter] = []

    def clock(self) -> HapticClock:
        return HapticClock(self.boot, self._offset_ns, 0)

    def scene(self, parameters: str = "") -> Scene | None:
        if parameters == "?next":
            return self.ahead
        return self.playing if self.answers else None

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
        return NOW + round(self.now_s * 1e9)


class Builder:
    """In the place of a thread that builds: at once, or, while `holds`, when the test says so."""

    def __init__(self, *_: object) -> None:
        self.holds = False
        self._waiting: list[Callable[[], None]] = []

    def submit(self, make: Callable[..., Any], *given: Any) -> Future[Any]:
        future: Future[Any] = Future()

        def build() -> None:
            try:
                future.set_result(make(*given))
            except Unplayable as error:
                future.set_exception(error)

        self._waiting.append(build)
        if not self.holds:
            self.finish()
        return future

    def finish(self) -> None:
        while self._waiting:
            self._waiting.pop(0)()


def drum_of(link: Any, sink: Any, *trim: OutputTrim) -> Drum:
    """A drum that takes these for its rig and its sound card."""
    return Drum(link, sink, "id", RateLimitedLog(lambda: 0), StopRequest(), *trim)


class Bench:
    """A drum that plays, whose rig sets it; `clock` moves with what is heard."""

    def __init__(self, clock: Time, scene: Scene = MESH) -> None:
        self.link, self.sink, self.clock, self.scene = Link(scene), Sink(), clock, scene
        self.drum = drum_of(self.link, self.sink)
        assert self.drum._catch_up()
        self.drum._next_clock = 1e9
        self.frames = self.seq = self.chokes = 0
        self.set()

    def set(self, **values: float) -> None:
        """The servo uses these values, by their wire names with _ for the dot, and says so."""
        self.link.revision += 1
        self.link.values |= {name.replace("_", ".", 1): value for name, value in values.items()}
        heard = state(boot=self.link.boot, revision=self.link.revision)
        self.drum._heard_state(encode(heard), 0)
        self.turn(2)  # one that builds, and one that lets it enter

    def turn(self, count: int = 1) -> None:
        for _ in range(count):
            self.drum._turn()

    @property
    def builder(self) -> Builder:
        builder: Any = self.drum._replacement._builder
        return builder

    def strike(self, boot: int = 1) -> None:
        self.seq += 1
        blow = strike_for_speed(self.scene, 1.0, 0.3, 0.1)
        struck = strike(
            boot=boot, seq=self.seq, t_ns=self.clock.monotonic_ns(), x=blow.x, y=blow.y, peak_estimate_N=blow.peak_N,
            contact_estimate_s=blow.contact_s, impulse_N_s=blow.impulse_N_s,
        )  # fmt: skip
        self.drum._strikes.take(encode(struck), self.clock.monotonic_ns())

    def sound(self, seconds: float) -> Sound:
        out = np.zeros((round(seconds * RATE), 2), np.float32)
        for start in range(0, len(out), BLOCK):
            part = out[start : start + BLOCK]
            mix(self.sink.mixer.buffers, part, RATE, NOW + round(self.frames * 1e9 / RATE))
            self.frames += len(part)
        self.clock.now_s += seconds
        return out[:, 0].astype(float)

    def choke(self, seq: int = 0) -> None:
        """A player stops the drum; each time anew, but for a number that is given."""
        self.chokes += 1
        choke = Choke(boot=9, seq=seq or self.chokes, t_ns=self.clock.monotonic_ns(), source="test")
        self.drum._strikes.take_choke(encode(choke), self.clock.monotonic_ns())

    @property
    def meter(self) -> Meter:
        return self.link.meters[-1]


def pitch(sound: Sound) -> float:
    """Frequency of its loudest partial, Hz."""
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound)), 16 * len(sound)))
    return float(np.argmax(spectrum)) * RATE / (16 * len(sound))


def piece(bench: Bench, first: int, *forces: float, seq: int = 1) -> None:
    """A piece of a contact whose first force, N, is of this tick."""
    given = np.array(forces, "<f4").tobytes()
    contact = Contact(boot=1, seq=seq, first_tick=first, rate_Hz=1000.0, forces=given, x=0.3, y=0.1)
    bench.drum._contacts.take(encode(contact), bench.clock.monotonic_ns())
