"""Haptic machine as a sound server sees it: a router, `scene`, `clock`, and strikes when the test says so."""

import dataclasses
import json
import os
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh
from rig_process import PATIENCE_S, wait_for

from drumstick.drum.calibrate import strike_for_speed
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from protocol.keys import Keys
from protocol.messages import Clock, Meter, Readback, State, Strike, decode, encode
from protocol.session import router_config
from realtime.service_options import command
from sound_server.options import SoundOptions
from sound_server.outputs import Outputs

# A drum without latency plays at once what is dated ahead; what is dated now is too late after a stall of 50 ms.
AHEAD_NS = 400_000_000


def drum(latency_s: float = 0.0, f01_Hz: float = 150.0, t60_s: float = 0.3) -> Scene:
    scene = Scene("test-drum")
    table = dataclasses.replace(scene.drum, latency_s=latency_s, f01_Hz=f01_Hz, t60_s=t60_s)
    return dataclasses.replace(scene, drum=table)


class HapticSide:
    """Its monotonic clock is `ahead_ns` ahead of ours, as another machine's would be."""

    def __init__(
        self,
        port: int,
        scene: Scene,
        boot: int = 7,
        ahead_ns: int = 1_000_000_000_000,
        rig: str = "main",
        router: zenoh.Session | None = None,
    ) -> None:
        self.scene, self.boot, self.ahead_ns = scene, boot, ahead_ns
        self.keys = Keys(rig)
        self.endpoint = f"tcp/127.0.0.1:{port}"
        self.meters: list[Meter] = []
        self.seq = 0
        self._tells_clock, self._untold = True, 0
        self._port = port
        self._session: zenoh.Session | None = None
        self.open(router)

    def another(self, rig: str, scene: Scene) -> "HapticSide":
        """One more rig at the same router, which ends with this one's."""
        return HapticSide(self._port, scene, rig=rig, router=self.session)

    def open(self, router: zenoh.Session | None = None) -> None:
        """Start the router; again after `close`, as a haptic machine that was restarted."""
        self._session = router or zenoh.open(router_config(self.endpoint))
        self._session.declare_queryable(self.keys.scene, self._answer_scene)
        self._session.declare_queryable(self.keys.clock, self._answer_clock)
        self._session.declare_queryable(self.keys.param("*"), self._answer_param)
        self._session.declare_subscriber(self.keys.meter, self._hear)

    def close(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None

    @property
    def session(self) -> zenoh.Session:
        assert self._session is not None
        return self._session

    def _answer_scene(self, query: zenoh.Query) -> None:
        query.reply(self.keys.scene, json.dumps(as_tables(self.scene)))

    def _answer_clock(self, query: zenoh.Query) -> None:
        if not self._tells_clock:
            self._untold += 1
            return
        query.reply(self.keys.clock, encode(Clock(boot=self.boot, t_ns=self.now_ns())))

    def _answer_param(self, query: zenoh.Query) -> None:
        gain = Readback(value=self.scene.listen.gain_dB, revision=0)
        query.reply(self.keys.param("listen.gain"), encode(gain))

    def _hear(self, sample: zenoh.Sample) -> None:
        self.meters.append(decode(sample.payload.to_bytes(), Meter))

    def keep_clock(self) -> None:
        """Answer no further question for the clock: the server goes on with the one that it knows."""
        self._tells_clock = False
        wait_for("a question for the clock", lambda: self._untold)
        for _ in range(2):  # the thread that asked tells a meter in each turn: the second is of a later one
            self.meter("anything", lambda m: True)

    def now_ns(self) -> int:
        return time.monotonic_ns() + self.ahead_ns

    def meter(self, what: str, good: Callable[[Meter], bool]) -> Meter:
        """The first meter from now on that is good."""
        self.meters.clear()
        return wait_for(f"a meter with {what}", lambda: next((m for m in list(self.meters) if good(m)), None))

    def struck(self, what: str, good: Callable[[Meter], bool]) -> Meter:
        """The first good meter after a strike; one that a stall of the machine made late is struck again."""
        self.meters.clear()
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            self.strike()
            again = time.monotonic() + 1.0
            while time.monotonic() < again:
                if found := next((m for m in list(self.meters) if good(m)), None):
                    return found
                time.sleep(0.01)
        raise AssertionError(f"struck for {PATIENCE_S:.0f} s in vain for a meter with {what}")

    def alive(self) -> list[str]:
        replies = self.session.liveliness().get(self.keys.alive("sound", "*"), timeout=PATIENCE_S)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok]

    def message(self, t_ns: int | None = None, seq: int | None = None) -> bytes:
        """The next strike, at 0.6 m/s beside half radius, now (never too late, without latency) or at `t_ns` of its
        own clock."""
        if seq is None:
            self.seq += 1
            seq = self.seq
        if t_ns is None:
            t_ns = self.now_ns() + (AHEAD_NS if self.scene.drum.latency_s == 0.0 else 0)
        blow = strike_for_speed(self.scene, 0.6, 0.4, 0.1)
        return encode(
            Strike(
                boot=self.boot,
                seq=seq,
                t_ns=t_ns,
                x=blow.x,
                y=blow.y,
                z_speed_m_per_s=0.6,
                level=0.3,
                peak_estimate_N=blow.peak_N,
                contact_estimate_s=blow.contact_s,
            )
        )

    def strike(self, payload: bytes | None = None) -> None:
        self.session.put(self.keys.strike, self.message() if payload is None else payload)

    def tell_state(self, revision: int = 0) -> None:
        state = State(
            boot=self.boot, t_ns=self.now_ns(), status="playing", z_m=0.0, v_m_per_s=0.0, force_N=0.0, x=0.0, y=0.0,
            roll_rate_Hz=0.0, v_e_m_per_s=0.0, strikes=0, ticks=0, overruns=0, lateness_p99_us=0.0,
            lateness_worst_us=0.0, ring_dropped=0, revision=revision, pending=False,
        )  # fmt: skip
        self.session.put(self.keys.state, encode(state))


class SoundProcess:
    """A real `python -m sound_server` and what it says on stderr."""

    def __init__(
        self,
        endpoint: str,
        audio: str,
        environment: dict[str, str],
        folder: Path,
        rigs: str,
        outputs: Outputs = (),
    ) -> None:
        self.lines: list[str] = []
        options = SoundOptions(rigs=tuple(rigs.split(",")), connect=endpoint, audio=audio, outputs=outputs)
        self.process = subprocess.Popen(
            command("sound_server", options),
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=folder,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def said(self, words: str) -> str:
        """Wait for a line with these words."""
        return wait_for(
            f"the line {words!r}", lambda: next((s for s in list(self.lines) if words in s), None)
        )

    def ended(self) -> int:
        """Its exit status, when it ends by itself."""
        status = self.process.wait(PATIENCE_S)
        self._reader.join(10.0)
        return status

    def stop(self, number: int) -> int:
        self.process.send_signal(number)
        return self.ended()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join(10.0)
        assert self.process.stderr is not None
        self.process.stderr.close()


@contextmanager
def sounding(
    endpoint: str,
    audio: str,
    folder: Path,
    environment: dict[str, str] | None = None,
    rigs: str = "main",
    outputs: Outputs = (),
) -> Iterator[SoundProcess]:
    """A sound server that is gone afterwards."""
    given = dict(os.environ) if environment is None else environment
    sound = SoundProcess(endpoint, audio, given, folder, rigs, outputs)
    try:
        yield sound
    finally:
        sound.close()
