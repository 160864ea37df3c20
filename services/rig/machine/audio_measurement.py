"""python -m rig.machine.audio_measurement: the scene's drum on an audio device, one block size after another; and JSON.

The sound server's own sinks and compiled callback, and the drum as the server makes it. A process of its own, as the
sound server is one. What is asked for comes as JSON at stdin. Exit status as the sound server's.
"""

import json
import logging
import random
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from drumstick.drum.build import Unplayable, copy_of, describe_renderer
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.engine import Engine
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.output.upsample import TAPS
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from haptic_server.servo.stall_detector import SELDOM_NS, StallDetector
from realtime.log import end_process, open_log
from rig.machine.audio_advice import BLOCKS, Row, advise, perceived
from rig.machine.audio_blocks import Played, StrikePath, is_enough, newer, row_of
from rig.machine.audio_device import NULL, UNKNOWN, audio_thread, is_jack, only_block, schedule, scheduling_of
from sound_server.receiving.contacts import own_delay_s
from sound_server.sinks.selection import open_sink
from sound_server.sinks.sink import Sink, SinkError

_LOOK_S = 0.3  # at the threads, before a block size is judged
_GATHER_S = 0.1  # the sink remembers 4096 blocks: a third of a second at the shortest and fastest
_STREAMED = (
    "this scene's drum sounds by the streamed force: its delay is counted, the force's own load is not. The test"
    " strikes the drum with blows; leave room for it"
)


def play(sink: Sink, ring: StrikeRing, blow: OfflineStrike, strikes_per_s: float, seconds: float) -> Played:
    """Strike a drum for so long, or until the sink is lost, at moments that know nothing of the sink's blocks."""
    chance, xruns, since = random.Random(1), sink.xruns, time.monotonic_ns()
    blocks, struck = [np.zeros((0, 3), np.int64)], list[int]()
    with StallDetector(SELDOM_NS) as witnesses:
        begun = next_look = next_strike = time.monotonic()
        while (now := time.monotonic()) < begun + seconds and not sink.lost:
            if now >= next_strike:
                struck.append(time.monotonic_ns())
                ring.push_blow(blow)
                next_strike = now + chance.uniform(0.5, 1.5) / strikes_per_s
            if now >= next_look:
                blocks.append(newer(sink.blocks, since))
                since = int(blocks[-1][:, 0].max(initial=since))
                next_look = now + _GATHER_S
            time.sleep(max(0.0, min(next_strike, next_look) - time.monotonic()))
        blocks.append(newer(sink.blocks, since))
    # A witness without its priority is late itself, and would excuse too much.
    stalls = np.zeros((0, 2), np.int64) if witnesses.refused else witnesses.stalls()
    times = np.array(struck, np.int64)
    return Played(
        np.concatenate(blocks), times, stalls, sink.xruns - xruns, sink.lost, tuple(witnesses.refused)
    )


class AudioTest:
    """A test on one device. `seconds`: of each block size at each priority."""

    def __init__(self, scene: Scene, audio: str, rate_Hz: int, seconds: float, strikes_per_s: float) -> None:
        self._scene, self._audio, self._rate_Hz = scene, audio, rate_Hz
        self._seconds, self._strikes_per_s = seconds, strikes_per_s
        self._is_streamed = scene.drum.excitation == "streamed"
        self._rest: Engine | None = None  # never sounds; each sink plays a copy
        self._facts: dict[str, Any] = {
            "scene": scene.name,
            "strikes_per_s": strikes_per_s,
            "seconds": seconds,
        }
        self._refused: list[tuple[int, SinkError]] = []
        self._rows: list[Row] = []
        self._granted = 0  # priority of the audio thread
        self._witnesses_refused: tuple[str, ...] = ()

    def run(self, wanted: Sequence[int]) -> dict[str, Any]:
        """Measure these block sizes, or without any all that the device takes. Raises SinkError, Unplayable."""
        only = only_block(self._audio, self._rate_Hz)
        for block in wanted or ((only,) if only else BLOCKS):
            try:
                if only and block != only:
                    own = f"JACK plays in blocks of {only} frames, whatever is asked of it"
                    raise SinkError(3, f"{own}; to change it: jack_bufsize {block}")
                self._try(block)
            except SinkError as error:
                self._refused.append((block, error))
        if not self._rows:
            raise self._refused[0][1]
        return self._found(only)

    def _try(self, block: int) -> None:
        sink = open_sink(self._audio, self._rate_Hz, block, awaited=True)
        try:
            self._measure(sink, block)
        finally:
            if not (sink.lost and is_jack(sink)):  # PortAudio would wait for ever for a JACK that gave it up
                sink.close()

    def _measure(self, sink: Sink, block: int) -> None:
        ring = StrikeRing()
        engine = self._engine(sink, ring)
        sink.mixer.make_ready(engine)
        sink.mixer.enter(engine)
        path = self._path(sink, block, engine)

        def played(seconds: float) -> Played:
            return play(sink, ring, full_scale(self._scene), self._strikes_per_s, seconds)

        thread = audio_thread(lambda: played(_LOOK_S))
        granted = scheduling_of(thread)
        self._granted = granted.priority
        for scheduling in (granted,) if granted == UNKNOWN else (granted, granted.other):
            is_granted = scheduling is granted
            if not is_granted and (sink.lost or not schedule(thread, scheduling)):
                return
            found = played(self._seconds)
            if not is_enough(found):
                why = sink.lost or "it stands still"
                raise SinkError(3, f"{sink.description} plays no blocks of {block} frames: {why}")
            self._witnesses_refused = found.witnesses_refused
            self._rows.append(row_of(found, block, sink.rate_Hz, path, scheduling.words, is_granted))

    def _engine(self, sink: Sink, ring: StrikeRing) -> Engine:
        if self._rest is None:
            fit = fitted(self._scene, sink.rate_Hz)
            self._rest = build(fit.scene, sink.rate_Hz, StrikeRing())
            words = "; ".join(filter(None, (describe_renderer(self._rest), fit.note)))
            self._facts |= {"device": sink.description, "rate_Hz": sink.rate_Hz, "drum": words}
        return copy_of(self._rest, ring)

    def _path(self, sink: Sink, block: int, engine: Engine) -> StrikePath:
        control: Any = engine.control[0]
        interpolator_ms = float(1e3 * TAPS / 2 * control["divisor"] / control["rate_Hz"])
        device_ms = 0.0 if self._audio == NULL else sink.latency_ms
        latency_s = self._scene.drum.latency_s
        if self._is_streamed:
            latency_s = own_delay_s(latency_s, block / sink.rate_Hz)
        return StrikePath(1e3 / self._scene.servo.rate_Hz, 1e3 * latency_s, interpolator_ms + device_ms)

    def _found(self, only: int | None) -> dict[str, Any]:
        latency_s = self._scene.drum.latency_s
        row, words = advise(self._rows, self._granted)
        if only:
            words.append(
                f"JACK has one block for all, {only}: to change it, jack_bufsize FRAMES; then test again"
            )
        if self._is_streamed:
            words.append(_STREAMED)
        return {
            **self._facts,
            "only_block": only,
            "priority_granted": self._granted,
            "real_time_can_be_had": any(each.real_time for each in self._rows),
            "witnesses_refused": self._witnesses_refused,
            "rows": [asdict(each) | {"fits": each.fits} for each in self._rows],
            "refused": [{"block": block, "reason": str(error)} for block, error in self._refused],
            "recommended": row and asdict(row),
            "advice": words,
            "perceived": perceived(row, latency_s) if row else (),
        }


def main() -> int:
    """Measure and print one JSON object; 2 or 3 with a line on stderr where it cannot be."""
    asked = json.load(sys.stdin)
    blocks, text = asked.pop("blocks"), asked.pop("scene_text")
    open_log()
    try:
        found = AudioTest(parse(text, "scene"), **asked).run(blocks)
    except (SinkError, Unplayable) as error:
        logging.error("%s", error)
        return error.status if isinstance(error, SinkError) else 2
    print(json.dumps(found), flush=True)
    return 0


if __name__ == "__main__":
    end_process(main())
