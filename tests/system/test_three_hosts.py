"""Three machines on a network that gets worse: cable, router, sound machine, clock, loss, OSC out of order.

The strikes are far apart and the drum is dry, so that each can be found in the recording of what was heard.
"""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hosts import require_root, stopped
from numpy.typing import NDArray
from rig_process import assert_steady, stood_still_s, wait_for
from three_hosts import AHEAD_S, HAPTIC, Probe, Running, ThreeHosts, seconds
from wav_heard import RATE, sound_in

from drumstick.scenes.scene_text import shipped_text
from haptic_server.servo.stall_detector import StallDetector
from protocol.messages import Meter, State, Strike
from sound_server.sinks.wavfile import MAX_S

pytestmark = [pytest.mark.system, pytest.mark.long, pytest.mark.real_clock, pytest.mark.timeout(1800)]
_CUT_S = 3.0
_BEYOND_A_LEASE_S = 15.0  # after ten without a sign of life Zenoh closes a link by itself
_LATENCY_S = 0.03
_GRACE_S = 0.05  # beyond its instant a strike is dropped
_OLD_METER = 20  # strikes between a meter, of which there are ten a second, and the state beside it


class Playing(ThreeHosts):
    """All of it plays; `here` hears at the haptic machine, `far` at the panel's."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        try:
            self.make_keys()
            self._write_scene()
            with (folder / "haptic" / "haptic" / "rig.toml").open("a") as file:
                file.write(f'[osc]\nbind = "{HAPTIC}:9100"\ntargets = ["192.168.1.40:9101"]\n')
                file.write('allow = ["192.168.1.40/32"]\n')
            self.start("haptic", "haptic", "--rig-file", "haptic/rig.toml", "--scene", "dry.toml")
            self.start("sound", "sound", "--rig-file", "sound/rig.toml", "--audio", "wav:heard.wav", "--json")
            self.start("panel", "panel", "--rig-file", "panel/rig.toml")
            self.here: Probe = self.probe("haptic")
            self.far: Probe = self.probe("panel", "listener")
        except BaseException:
            self.close()
            raise

    def _write_scene(self) -> None:
        text = shipped_text("roll").replace("t60_s = 1.2", f"t60_s = 0.03\nlatency_s = {_LATENCY_S}")
        text = text.replace("dv_m_per_s = 0.2", "dv_m_per_s = 0.5").replace('"roll"', '"dry"')
        (self.folder / "haptic" / "dry.toml").write_text(text)

    def links(self) -> set[str]:
        """The panel machine's ends of its links to the haptic machine's public listener."""
        rows = self.venue["panel"].run("cat", "/proc/net/tcp", "/proc/net/tcp6").splitlines()
        found = (re.search(r"(\S+):(\S+) \S*0A01A8C0:1D18 01 ", row) for row in rows)
        return {match[2] for match in found if match}

    @property
    def state(self) -> State:
        return self.here.last(State)

    @property
    def meter(self) -> Meter:
        return self.here.last(Meter)

    def wait_played(self, more: int) -> Meter:
        """The first meter from which so many more strikes were played than in the one before."""
        before = wait_for("a meter", lambda: self.meter).played
        return wait_for(
            f"{more} strikes more", lambda: m if (m := self.meter).played >= before + more else None
        )


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Playing]:
    require_root()
    made = Playing(tmp_path_factory.mktemp("venue"))
    try:
        yield made
    finally:
        made.close()


def test_everything_comes_up_over_tls_and_the_clocks_differ(stage: Playing) -> None:
    meter = wait_for("sound", lambda: m if (m := stage.here.last(Meter)) and m.played > 20 else None)
    assert "heard.wav" in meter.sink
    assert (meter.duplicates, meter.refused) == (0, 0)
    clock = "import time; print(time.monotonic())"
    there, here = (float(stage.venue[h].run(sys.executable, "-c", clock)) for h in ("sound", "haptic"))
    assert there - here > AHEAD_S - 60
    # With a clock that is a thousand seconds off every strike would be late, or play at once.
    more = stage.wait_played(50)
    assert more.late - meter.late < more.played - meter.played
    assert 0.0 < more.arrival_ms < 1e3 * AHEAD_S / 2.0
    wait_for("the panel's address", lambda: "panel: http" in stage.running["panel"].said)
    (token,) = (stage.folder / "panel" / "home").rglob("panel-token")
    visit = f"http://127.0.0.1:8080/?token={token.read_text().strip()}"
    page = f"import urllib.request as u; print(u.urlopen({visit!r}).status)"
    assert stage.venue["panel"].run(sys.executable, "-c", page) == "200\n"
    seen = stage.venue["haptic"].run("cat", "/proc/net/tcp", "/proc/net/tcp6")
    assert re.search(r"0A01A8C0:1D18 1401A8C0:", seen), "the sound machine is not at the TLS listener"


def test_a_pulled_cable_leaves_the_force_alone_and_nothing_sounds_twice_or_late(stage: Playing) -> None:
    stage.wait_played(10)
    links = stage.links()
    assert links
    with StallDetector() as probes:
        before, meter = stage.state, stage.meter
        stage.venue.pull("haptic")
        wait_for("a cut of that length", lambda: _ahead_s(stage) > _CUT_S)
        during = stage.state
        stage.venue.plug("haptic")
        back = wait_for("telemetry", lambda: s if (s := stage.far.last(State)).ticks > during.ticks else None)
    assert_steady(before, during, stood_still_s(probes))
    assert during.boot == before.boot == back.boot
    after = stage.wait_played(20)
    assert after.duplicates == meter.duplicates
    # What was struck meanwhile is dropped or lost: fewer were played than would have been.
    made = stage.state.strikes - before.strikes
    assert after.played - meter.played <= made - 0.6 * (during.strikes - before.strikes)
    assert stage.links() == links  # it comes back by itself, with no link opened anew


def _ahead_s(stage: Playing) -> float:
    # The servo's time that is known here and not at the panel: with a cable in it is that of a message on its way.
    return 1e-9 * (stage.state.t_ns - stage.far.last(State).t_ns)


def test_a_cable_that_is_out_for_longer_than_a_lease_leaves_all_the_same(stage: Playing) -> None:
    stage.wait_played(10)
    before, meter = stage.state, stage.meter
    stage.venue.pull("haptic")
    seconds(_BEYOND_A_LEASE_S)
    during = stage.state
    stage.venue.plug("haptic")
    wait_for("telemetry", lambda: stage.far.last(State).ticks > during.ticks)
    after = stage.wait_played(20)
    assert before.boot == during.boot == stage.state.boot
    assert after.duplicates == meter.duplicates
    assert after.played - meter.played <= stage.state.strikes - before.strikes


def test_a_killed_router_and_its_public_listener_come_back(stage: Playing) -> None:
    stage.wait_played(10)
    before, meter = stage.state, stage.meter
    children = stage.running["haptic"].children()
    for service in ("haptic_server.gateway", "haptic_server.access"):
        os.kill(children[service], signal.SIGKILL)
    wait_for("telemetry here", lambda: stage.state.t_ns > before.t_ns + 1_500_000_000)
    wait_for("telemetry there", lambda: stage.far.last(State).t_ns > before.t_ns + 1_500_000_000)
    after = stage.wait_played(20)
    assert stage.state.boot == before.boot  # the servo never stopped
    assert after.duplicates == meter.duplicates
    assert after.played - meter.played <= stage.state.strikes - before.strikes + 1


def test_a_sound_machine_that_stood_still_plays_nothing_late_and_nothing_twice(stage: Playing) -> None:
    stage.wait_played(10)
    with stopped(stage.venue["sound"].processes()):
        before, meter = stage.state, stage.meter
        seconds(_CUT_S)
        during = stage.state
    after = stage.wait_played(20)
    missed = during.strikes - before.strikes
    assert missed > 10
    assert after.late - meter.late >= 0.5 * missed  # they waited in its buffers, and came too late
    assert after.played - meter.played <= stage.state.strikes - before.strikes - 0.9 * missed + _OLD_METER
    assert after.duplicates == meter.duplicates


def test_two_frames_of_a_hundred_lost_take_no_strike_twice_and_few_at_all(stage: Playing) -> None:
    meter = stage.wait_played(10)
    first = stage.state
    with stage.venue.losing(2):
        wait_for("losses", lambda: stage.venue.lost() > 20)
        wait_for("strikes", lambda: stage.state.strikes > first.strikes + 100)
        after, last = stage.meter, stage.state
    made = last.strikes - first.strikes
    assert after.duplicates == meter.duplicates
    # TCP sends again after 200 ms at the least what was lost, in order: what comes too late behind it is dropped.
    arrived = after.played - meter.played + after.late - meter.late
    assert made - _OLD_METER <= arrived <= made + _OLD_METER
    assert after.played > meter.played


def test_osc_out_of_order_tells_the_loss_by_its_numbers(stage: Playing) -> None:
    stage.cable.weather(0.1, 0.1)
    before = stage.state
    dump = Running(stage.venue["daw"], ["oscdump", "-L", "9101"], stage.folder, os.environ)
    try:
        wait_for("strikes by OSC", lambda: len(_numbers(dump)) > 80)
    finally:
        dump.stop()
        stage.cable.weather(0.0, 0.0)
    numbers = _numbers(dump)
    missing = set(range(min(numbers), max(numbers) + 1)) - set(numbers)
    assert len(set(numbers)) == len(numbers)  # UDP lost some, and doubled none
    assert 0 < len(missing) < 0.3 * len(numbers)
    assert any(later < earlier for earlier, later in pairwise(numbers))
    assert stage.state.boot == before.boot
    assert stage.running["haptic"].process.poll() is None


def _numbers(dump: Running) -> list[int]:
    found = (re.search(r" /drumstick/strike ifffff (\d+) ", line) for line in list(dump.lines))
    return [int(match[1]) for match in found if match]


def test_the_strikes_heard_far_away_are_those_made_here(stage: Playing) -> None:
    wait_for("a hundred strikes", lambda: len(stage.far.got[Strike]) > 100)
    numbers = [strike.seq for _, strike in list(stage.far.got[Strike])]
    assert len(set(numbers)) == len(numbers)
    assert numbers == sorted(numbers)


def test_what_was_heard_is_each_played_strike_once(stage: Playing) -> None:
    """Last: it ends the sound machine's play."""
    stage.wait_played(10)
    stage.venue.pull("haptic")
    wait_for("a cut of that length", lambda: _ahead_s(stage) > _CUT_S)
    stage.venue.plug("haptic")
    stage.wait_played(20)
    apart_as_made_s = 1.0 / stage.state.roll_rate_Hz
    sound_machine = stage.running["sound"]
    assert sound_machine.stop() == 0
    summary = json.loads(next(line for line in sound_machine.lines if line.startswith("{")))
    sound = sound_in(stage.folder / "sound" / "heard.wav")
    starts_s, peaks = _blows(sound)
    if len(sound) < MAX_S * RATE:  # nothing is written behind that
        assert len(starts_s) == pytest.approx(summary["strikes_played"], rel=0.02, abs=3)
    apart_s = np.diff(starts_s)
    # What is played twice, or late and so on top of others, stands closer to its neighbour, or is louder.
    assert (apart_s < 0.5 * apart_as_made_s).sum() <= 0.01 * len(starts_s) + 1
    neighbours = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(peaks, 2, "edge"), 5), axis=1)
    assert (peaks > 1.5 * neighbours).sum() <= 0.01 * len(starts_s) + 1
    assert (apart_s > 0.7 * _CUT_S).sum() >= 1  # the silence of the cut


def _blows(sound: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Beginnings of the blows, s, and their peaks: a dry drum is silent again long before the next one."""
    window = RATE // 1000
    loud = np.sqrt((sound**2).sum(axis=1))
    loudness = loud[: len(loud) // window * window].reshape(-1, window).max(axis=1)
    above = np.flatnonzero(loudness > 0.1 * np.percentile(loudness, 99.5))
    starts = above[np.concatenate([[True], np.diff(above) > 15])]
    ends = [*starts[1:], len(loudness)]
    peaks = [loudness[start:end].max() for start, end in zip(starts, ends, strict=True)]
    return starts / 1000.0, np.array(peaks)
