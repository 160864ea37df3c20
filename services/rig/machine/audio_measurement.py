"""python -m rig.machine.audio_measurement: the scene's drum on an audio device, one block size after another; and JSON.

The sound server's own sinks and compiled callback, and the drum as the server makes it. A process of its own, as the
sound server is one. Exit status as the sound server's.
"""

import argparse
import json
import logging
import random
import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from drumstick.drum.build import Unplayable, copy_of, describe_renderer
from drumstick.drum.calibrate import build
from drumstick.drum.engine import Engine
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.upsample import TAPS
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from realtime.log import end_process, open_log
from rig.machine.audio_advice import BLOCKS, STREAMED, Row, advise
from rig.machine.audio_blocks import Numbers, Played, StrikePath, blows, newer, row_of
from rig.machine.audio_device import (
    UNKNOWN,
    AudioThread,
    TestedSink,
    audio_thread,
    is_jack,
    only_block,
    opened,
    run_ns,
)
from rig.machine.stall_witness import StallWitnesses
from sound_server.receiving.contacts import own_delay_s
from sound_server.sinks.sink import SinkError

_LOOK_S = 0.3  # at the threads, before a block size is judged
_GATHER_S = 0.1  # the sink remembers 4096 blocks: a third of a second at the shortest and fastest


class Player:
    """Strikes a drum at moments that know nothing of the device's blocks."""

    def __init__(self, scene: Scene, ring: StrikeRing, strikes_per_s: float) -> None:
        self._blows, self._ring, self._chance = blows(scene), ring, random.Random(1)
        self._apart_s = 1.0 / strikes_per_s

    def play(self, sink: TestedSink, seconds: float) -> tuple[Numbers, Numbers]:
        """Play for so long, or until the sink is lost; the blocks of that time, and when it struck, ns."""
        since = time.monotonic_ns()
        blocks, struck = [np.zeros((0, 3), np.int64)], list[int]()
        begun = next_look = next_strike = time.monotonic()
        while (now := time.monotonic()) < begun + seconds and not sink.lost:
            if now >= next_strike:
                struck.append(time.monotonic_ns())
                self._ring.push_blow(next(self._blows))
                next_strike = now + self._apart_s * self._chance.uniform(0.5, 1.5)
            if now >= next_look:
                blocks.append(newer(sink.blocks, since))
                since = int(blocks[-1][:, 0].max(initial=since))
                next_look = now + _GATHER_S
            time.sleep(max(0.0, min(next_strike, next_look) - time.monotonic()))
        return np.concatenate((*blocks, newer(sink.blocks, since))), np.array(struck, np.int64)


class AudioTest:
    """A test on one device. `seconds`: of each block size at each priority."""

    def __init__(self, scene: Scene, audio: str, rate_Hz: int, seconds: float, strikes_per_s: float) -> None:
        self._scene, self._audio, self._rate_Hz = scene, audio, rate_Hz
        self._seconds, self._strikes_per_s = seconds, strikes_per_s
        self._rest: Engine | None = None  # never sounds; each sink plays a copy
        self._refused: list[dict[str, Any]] = []
        self._rows: list[Row] = []
        self._untried: tuple[int, ...] = ()
        self._is_streamed = scene.drum.excitation == "streamed"
        self._witnesses_refused: list[str] = []
        self._facts: dict[str, Any] = {}

    def run(self, wanted: Sequence[int]) -> dict[str, Any]:
        """Measure these block sizes, or without any all that the device takes. Raises SinkError, Unplayable."""
        only = only_block(self._audio, self._rate_Hz)
        self._facts["only_block"] = only
        blocks = wanted or ((only,) if only else BLOCKS)
        for number, block in enumerate(blocks, 1):
            if not self._try(block):
                self._untried = tuple(blocks[number:])
                break
        if not self._rows:
            raise SinkError(self._refused[0]["status"], self._refused[0]["reason"])
        return self._found()

    def _try(self, block: int) -> bool:
        # False when no other block can be tried after this one.
        try:
            sink = opened(self._audio, self._rate_Hz, block)
        except SinkError as error:
            self._refuse(block, error)
            return True
        try:
            self._measure(sink, block)
        except SinkError as error:
            self._refuse(block, error)
        if sink.lost and is_jack(sink):
            return False  # and is not closed: PortAudio would wait for ever for a JACK that gave it up
        sink.close()
        return True

    def _refuse(self, block: int, error: SinkError) -> None:
        self._refused.append({"block": block, "reason": str(error), "status": error.status})

    def _engine(self, sink: TestedSink, ring: StrikeRing) -> Engine:
        if self._rest is None:
            fit = fitted(self._scene, sink.rate_Hz)
            self._rest = build(fit.scene, sink.rate_Hz, StrikeRing())
            words = "; ".join(filter(None, (describe_renderer(self._rest), fit.note)))
            self._facts |= {"device": sink.description, "rate_Hz": sink.rate_Hz, "drum": words}
        return copy_of(self._rest, ring)

    def _measure(self, sink: TestedSink, block: int) -> None:
        ring = StrikeRing()
        engine = self._engine(sink, ring)
        sink.mixer.enter(engine)
        player = Player(self._scene, ring, self._strikes_per_s)
        before = run_ns()
        player.play(sink, _LOOK_S)
        thread = audio_thread(before)
        granted = 0 if thread is None else thread.granted.priority
        self._facts |= {"priority_granted": granted, "real_time_can_be_had": granted > 0}
        self._judge(sink, player, block, engine, thread, granted=True)
        if not sink.lost and thread is not None and thread.set(thread.other()):
            self._facts["real_time_can_be_had"] = True
            self._judge(sink, player, block, engine, thread, granted=False)

    def _judge(
        self,
        sink: TestedSink,
        player: Player,
        block: int,
        engine: Engine,
        thread: AudioThread | None,
        granted: bool,
    ) -> None:
        priority, xruns = UNKNOWN if thread is None else thread.words, sink.xruns
        with StallWitnesses() as witnesses:
            blocks, struck = player.play(sink, self._seconds)
        self._witnesses_refused = witnesses.refused
        # A witness without its priority is late itself, and would excuse too much.
        stalls = np.zeros((0, 2), np.int64) if witnesses.refused else witnesses.stalls()
        if len(blocks) < 2:
            raise SinkError(
                3, f"{sink.description} plays no blocks of {block} frames: {sink.lost or 'it stands still'}"
            )
        control: Any = engine.control[0]
        latency_s = self._scene.drum.latency_s
        path = StrikePath(
            1e3 / self._scene.servo.rate_Hz,
            1e3 * (own_delay_s(latency_s, block / sink.rate_Hz) if self._is_streamed else latency_s),
            float(1e3 * TAPS / 2 * control["divisor"] / control["rate_Hz"]),
            sink.latency_ms,
        )
        played = Played(blocks, struck, stalls, sink.xruns - xruns, sink.lost)
        self._rows.append(row_of(played, block, sink.rate_Hz, path, priority, granted))

    def _found(self) -> dict[str, Any]:
        granted, can_be_had = (self._facts[key] for key in ("priority_granted", "real_time_can_be_had"))
        advice = advise(self._rows, granted, can_be_had, self._scene.drum.latency_s, self._untried)
        return {
            "scene": self._scene.name,
            **self._facts,
            "strikes_per_s": self._strikes_per_s,
            "seconds": self._seconds,
            "witnesses_refused": self._witnesses_refused,
            "rows": [asdict(row) | {"fits": row.fits} for row in self._rows],
            "refused": [{"block": one["block"], "reason": one["reason"]} for one in self._refused],
            "recommended": None if advice.row is None else {
                "block": advice.row.block, "real_time": advice.row.real_time, "delay_ms": asdict(advice.row.delay_ms),
            },
            "advice": (*advice.words, *([STREAMED] if self._is_streamed else [])),
            "perceived": advice.perceived,
        }  # fmt: skip


def main() -> int:
    """Measure and print one JSON object; 2 or 3 with a line on stderr where it cannot be."""
    arguments = argparse.ArgumentParser(prog="rig.machine.audio_measurement", description=__doc__)
    arguments.add_argument("--scene-text", required=True, help="TOML")
    arguments.add_argument("--audio", required=True)
    arguments.add_argument("--rate", type=int, required=True)
    arguments.add_argument("--block", type=int, action="append", default=[])
    arguments.add_argument("--seconds", type=float, required=True)
    arguments.add_argument("--strikes-per-s", type=float, required=True)
    given = arguments.parse_args()
    open_log()
    test = AudioTest(
        parse(given.scene_text, "scene"), given.audio, given.rate, given.seconds, given.strikes_per_s
    )
    try:
        found = test.run(given.block)
    except SinkError as error:
        logging.error("%s", error)
        return error.status
    except Unplayable as error:
        logging.error("%s", error)
        return 2
    print(json.dumps(found), flush=True)
    return 0


if __name__ == "__main__":
    end_process(main())
