"""From a strike to its first sample, as a listener hears it: drumstick lab strike-latency [--seconds 45].

A whole rig plays a roll on JACK's dummy driver (48 kHz, block 64, real-time priority where it is permitted), and a
client of JACK's is connected to the sound server's own port. Milliseconds from the contact's own instant, as the strike
tells it, to the first sample that is 40 dB below a strike's peak, by JACK's frames: as soon as can be; with a latency
longer than that took; of a streamed force. Beside each, in the same seconds: from the strike to the kernel's receipt of
its OSC datagram, and to a Zenoh subscriber; a bare datagram; and a thread of the force loop's rate and priority with
nothing to do. The pickup is where the stick strikes, so the sound has no way through the head.
"""

import argparse
import json
import math
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from rig_process import Listener, Rig, running, wait_for

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse
from drumstick_lab.benchmarks.latency.arrivals import Arrivals
from drumstick_lab.benchmarks.latency.first_samples import (
    ABOVE,
    Times,
    cycles_of,
    delays_ns,
    first_samples,
    times_ns,
)
from drumstick_lab.benchmarks.latency.idle_thread import NUMBER, IdleThread
from drumstick_lab.benchmarks.latency.jack_listener import JackListener, Recorded
from drumstick_lab.benchmarks.sound.jack_device import RATE_HZ, dummy_device
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.this_machine import real_time_priority
from protocol.messages import Meter, Strike, decode

BLOCK = 64
SERVER_PRIORITY = 70  # JACK's; its clients' threads get 5 less
GOAL_MS, SPREAD_GOAL_MS = 4.0, 1.0
MARGIN_MS, MOST_MS = 1.0, 30.0  # a roll's strikes are 43 ms apart
SHORTEST_S = 20.0  # less is not stored
SETTLE_S = 2.0  # of a rig that has begun to play, before it counts
EARLY_S = 0.003  # the force of a tick reaches two ticks ahead in the drum
# 300 Hz and 20 ms: each strike has died away long before the next one. The player's unevenness leaves no strike at the
# same place in its tick and block as the one before.
SCENE = """
name = "latency"
[stick]
z_ss_m = -0.02
[effects.pulse]
dv_m_per_s = 0.2
trigger = "exit"
[hand]
orbit_radius = 0.0
[hand.human]
interval_percent = 2.0
level_dB = 0.1
[drum]
f01_Hz = 300.0
t60_s = 0.02
excitation = "{excitation}"
latency_s = {latency_s}
[listen]
pickups = [[0.0, 0.0, 0.0]]
"""


class StrikeListener:
    """Strikes of a rig as they come over Zenoh, whose thread only puts them down."""

    def __init__(self, session: zenoh.Session, rig: Rig) -> None:
        self._got: list[tuple[bytes, int]] = []
        hear = zenoh.handlers.Callback(self._hear, indirect=False)
        self._subscriber = session.declare_subscriber(rig.keys.strike, hear)

    def _hear(self, sample: zenoh.Sample) -> None:
        self._got.append((sample.payload.to_bytes(), time.monotonic_ns()))

    def close(self) -> tuple[list[Strike], Times]:
        """The strikes, and when each came."""
        self._subscriber.undeclare()
        came_ns = [at_ns for _, at_ns in self._got]
        return [decode(payload, Strike) for payload, _ in self._got], np.array(came_ns, np.int64)


def percentiles_ms(ns: Times) -> dict[str, float]:
    p1, p50, p99 = np.percentile(ns, (1, 50, 99)) / 1e6
    return {"p1": round(float(p1), 3), "p50": round(float(p50), 3), "p99": round(float(p99), 3)}


def osc_delays_ns(heard: Arrivals, struck_ns: dict[int, int]) -> Times:
    from pythonosc.osc_message import OscMessage

    found: list[int] = []
    for payload, at_ns in heard.got:
        if payload.startswith(b"/drumstick/strike\0"):
            seq = int(OscMessage(payload).params[0])
            if seq in struck_ns:
                found.append(at_ns - struck_ns[seq])
    return np.array(found, np.int64)


def drum_ms(text: str, strike: Strike, above: float) -> float:
    """Time that the drum itself takes of such a strike, without rig and device: its interpolator, and until it has come to
    `above` of its peak."""
    at_s, whole_s, first_ns = 0.02, 0.05, 1_000_000_000
    strikes = StrikeRing()
    engine = build(parse(text, "latency"), RATE_HZ, strikes)
    onset_ns = first_ns + round(at_s * 1e9)
    force = (strike.peak_estimate_N, strike.contact_estimate_s, strike.impulse_N_s)
    strikes.push(onset_ns, strike.x, strike.y, *force)
    sound = np.zeros((round(whole_s * RATE_HZ), 2), np.float32)
    render_all(engine, sound, BLOCK, first_ns)
    return 1e3 * (float(first_samples(sound[:, 0], RATE_HZ, above).at[0]) / RATE_HZ - at_s)


class Played:
    """One rig, heard for so many seconds."""

    def __init__(self, folder: Path, text: str, seconds: float) -> None:
        path = folder / "latency.toml"
        path.write_text(text, encoding="utf-8")
        options = ("--scene", str(path), "--fresh", "--audio", "jack", "--audio-block", str(BLOCK))
        with ExitStack() as open_ones:
            rig = open_ones.enter_context(running("up", *options))
            session = rig.client()
            meters = Listener(session, rig.keys.meter, Meter)
            wait_for(
                "strikes that sound",
                lambda: meters.got and meters.got[-1].played and meters.got[-1].peak_left,
            )
            listener = JackListener("drumstick-listener", seconds + SETTLE_S + 10.0, BLOCK)
            output = listener.outputs()[0]
            self.port_ms = listener.playback_latency_ms()
            self.osc = open_ones.enter_context(Arrivals(rig.osc_out))
            self.bare = open_ones.enter_context(Arrivals())
            listener.listen(output)
            time.sleep(SETTLE_S)
            self.before = meters.got[-1]
            strikes = StrikeListener(session, rig)
            with IdleThread(self.bare.port) as self.idle:
                time.sleep(seconds)
            self.strikes, self.came_ns = strikes.close()
            time.sleep(0.1)  # the last of them sounds
            self.after = meters.got[-1]
            self.recorded: Recorded = listener.close()
            session.close()


def row_of(played: Played, latency_ms: float) -> dict[str, Any]:
    struck_ns = np.array([strike.t_ns for strike in played.strikes], np.int64)
    recorded = played.recorded
    first = first_samples(recorded.samples, recorded.rate_Hz)
    least_ns = round(max(latency_ms * 1e6 - EARLY_S * 1e9, 0.0))
    sound_ns, unheard = delays_ns(struck_ns, times_ns(recorded, first.at), least_ns)
    bare_ns = np.array([at_ns - NUMBER.unpack(payload)[0] for payload, at_ns in played.bare.got], np.int64)
    return {
        "latency_ms": latency_ms,
        "strikes": len(played.strikes),
        "unheard": unheard,
        "rest_of_threshold": round(first.rest, 4),
        "sound_ms": percentiles_ms(sound_ns),
        "port_ms": round(played.port_ms, 3),
        "osc_ms": percentiles_ms(osc_delays_ns(played.osc, {strike.seq: strike.t_ns for strike in played.strikes})),
        "zenoh_ms": percentiles_ms(played.came_ns - struck_ns),
        "bare_ms": percentiles_ms(bare_ns),
        "idle_ms": percentiles_ms(played.idle.late_ns),
        "idle_refused": played.idle.refused,
        "callback_ms": percentiles_ms(cycles_of(recorded).held_up_ns),
        "late": played.after.late - played.before.late,
        "bridged": played.after.underflows - played.before.underflows,
        "xruns": played.after.xruns - played.before.xruns,
    }  # fmt: skip


def measured(seconds: float, priority: int) -> dict[str, Any]:
    rows: dict[str, Any] = {}
    found: dict[str, Any] = {
        "block": BLOCK,
        "rate_Hz": RATE_HZ,
        "jack_priority": priority,
        "seconds": seconds,
    }
    with dummy_device(BLOCK, priority), tempfile.TemporaryDirectory() as folder:

        def play(name: str, excitation: str, latency_ms: float) -> Played:
            text = SCENE.format(excitation=excitation, latency_s=latency_ms * 1e-3)
            played = Played(Path(folder), text, seconds)
            rows[name] = row_of(played, latency_ms)
            print(name, json.dumps(rows[name]), flush=True)
            return played

        first = play("at_once", "analytic", 0.0)
        above_ms = math.ceil(rows["at_once"]["sound_ms"]["p99"] + MARGIN_MS)
        play("later", "analytic", min(float(above_ms), MOST_MS))
        play("streamed", "streamed", 0.0)
    text = SCENE.format(excitation="analytic", latency_s=0.0)
    found["tick_ms"] = 1e3 / parse(text, "latency").servo.rate_Hz
    found["drum_ms"] = round(drum_ms(text, first.strikes[0], ABOVE), 3)
    found["drum_louder_ms"] = round(drum_ms(text, first.strikes[0], 10.0 * ABOVE), 3)  # to 20 dB below
    return {**found, "rows": rows}


def spread_ms(row: dict[str, float]) -> float:
    return row["p99"] - row["p1"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    words = f"of each of the three rigs; below {SHORTEST_S:g} nothing is stored"
    parser.add_argument("--seconds", type=float, default=45.0, help=words)
    seconds = parser.parse_args().seconds
    found = measured(seconds, SERVER_PRIORITY if real_time_priority() else 0)
    at_once, later = found["rows"]["at_once"], found["rows"]["later"]
    if at_once["sound_ms"]["p50"] > GOAL_MS:
        print(f"above the goal: p50 {GOAL_MS:g} ms")
    beyond_ms = spread_ms(later["sound_ms"]) - spread_ms(later["idle_ms"])
    if beyond_ms > SPREAD_GOAL_MS:
        print(
            f"above the goal: a spread {SPREAD_GOAL_MS:g} ms beyond the idle thread's, not {beyond_ms:.2f} ms"
        )
    if seconds >= SHORTEST_S:
        stored.store("strike_latency", found)


if __name__ == "__main__":
    main()
