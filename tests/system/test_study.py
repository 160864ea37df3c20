"""A study with a whole rig: a scripted player that answers each click plays by OSC, and the tables say so."""

import csv
import os
import queue
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, running, wait_for

from protocol.messages import STICK, Meter, Strike, decode
from rig.study.rig_link import METRONOME
from rig.study.session_log import Session
from rig.study.task import read

pytestmark = pytest.mark.system

TASK = """
name = "by a script"
[[block]]
name = "with the metronome"
condition = "a script that strikes after each click"
source = "osc"
rate_Hz = 4.0
strikes = 8
count_in = 2
metronome = "throughout"
[[block]]
name = "alone"
condition = "the haptic stick, rolling by itself"
duration_s = 1.5
"""
HALF_S = 0.5 / 4.0  # of the time between two clicks


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("up") as started:
        yield started


class ScriptedPlayer:
    """Strikes by OSC as soon as it hears a click of the metronome, until closed; `answered`: times of those, s."""

    def __init__(self, session: zenoh.Session, rig: Rig, osc: OscPort) -> None:
        self._osc = osc
        self.answered: list[float] = []
        self._heard: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._clicks = session.declare_subscriber(
            rig.keys.strike, lambda sample: self._heard.put(sample.payload.to_bytes())
        )
        self._thread = threading.Thread(target=self._play)
        self._thread.start()

    def _play(self) -> None:
        while (payload := self._heard.get()) is not None:
            strike = decode(payload, Strike)
            if strike.source == METRONOME:
                self.answered.append(strike.t_ns * 1e-9)
                self._osc.send("/drumstick/play/strike", 0.2, 0.0, 0.5)

    def close(self) -> None:
        self._clicks.undeclare()
        self._heard.put(None)
        self._thread.join()


@pytest.fixture
def player(session: zenoh.Session, rig: Rig, osc: OscPort) -> Iterator[ScriptedPlayer]:
    made = ScriptedPlayer(session, rig, osc)
    yield made
    made.close()


def study(rig: Rig, *words: str | Path) -> subprocess.Popen[str]:
    command = [*DRUMSTICK, "study", *map(str, words)]
    if words[0] == "run":
        command += ["--rig", rig.name, "--connect", rig.endpoint]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def done(process: subprocess.Popen[str], status: int = 0) -> str:
    said, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == status, said
    return said


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return [*csv.DictReader(file)]


def asynchronies_ms(struck: list[float], clicks: list[float]) -> list[float]:
    """Asynchronies of the clicks after the count-in that have a strike: the nearest of those that are nearest to it."""
    own: dict[float, list[float]] = {}
    for strike in struck:
        nearest = min(clicks, key=lambda click: abs(strike - click))
        if abs(strike - nearest) < HALF_S:
            own.setdefault(nearest, []).append(strike - nearest)
    return [1e3 * min(own[click], key=abs) for click in clicks[2:] if click in own]


def test_the_table_recovers_what_was_played(
    rig: Rig, session: zenoh.Session, player: ScriptedPlayer, tmp_path: Path
) -> None:
    (tmp_path / "task.toml").write_text(TASK, encoding="utf-8")
    heard = Listener(session, rig.keys.strike, Strike)
    wait_for("the roll", lambda: any(strike.source == STICK for strike in heard.got))
    meters = Listener(session, rig.keys.meter, Meter)
    wait_for("the sound server", lambda: meters.got)
    folder = tmp_path / "study"
    run = ("run", "--player", "p01", "--task", tmp_path / "task.toml", "--folder", folder)
    assert "The session is whole." in done(study(rig, *run))
    done(study(rig, "export", folder, "--out", tmp_path / "study.csv"))

    clicks = [strike.t_ns * 1e-9 for strike in heard.got if strike.source == METRONOME]
    struck = [strike.t_ns * 1e-9 for strike in heard.got if strike.source.startswith("osc")]
    assert len(clicks) == 10  # two of them count in
    late_s = [strike - click for strike, click in zip(struck, player.answered, strict=True)]
    assert min(late_s) > 0.0  # nobody hears a click before it is there
    wanted = asynchronies_ms(struck, clicks)
    if max(late_s) < HALF_S:  # else the machine stood still, and a strike may be nearer to another click
        assert wanted == pytest.approx([1e3 * late for late in late_s[2:]])
    synchronised, free = rows(tmp_path / "study-blocks.csv")
    told = [row for row in rows(tmp_path / "study.csv") if row["asynchrony_ms"]]
    assert [float(row["asynchrony_ms"]) for row in told] == pytest.approx(wanted, abs=1e-3)
    assert float(synchronised["asynchrony_mean_ms"]) == pytest.approx(sum(wanted) / len(wanted), abs=1e-3)
    assert int(synchronised["misses"]) == 8 - len(wanted)
    assert (synchronised["phase"], free["phase"]) == ("synchronisation", "free")
    assert (synchronised["lost"], free["lost"]) == ("0", "0")
    assert float(free["strikes"]) > 5
    assert {row["source"] for row in rows(tmp_path / "study.csv") if row["phase"] == "free"} == {"stick"}
    assert float(free["output_latency_ms"]) > 0.0


@pytest.mark.long
def test_killed_amid_a_block_it_keeps_what_was_played_and_plays_that_block_again(
    rig: Rig, player: ScriptedPlayer, tmp_path: Path
) -> None:
    folder, log = tmp_path / "study", tmp_path / "study" / "p01" / "session-001.jsonl"
    run = ("run", "--player", "p01", "--task", tmp_path / "task.toml", "--folder", folder)

    def lasting(strikes: int, duration_s: float) -> None:
        """The two blocks are so long from now on, also by the log: a session goes on with its own task only.

        One that is to be cut lasts a minute, so that the signal comes amid it, however late.
        """
        text = TASK.replace("strikes = 8", f"strikes = {strikes}").replace("1.5", f"{duration_s}")
        (tmp_path / "task.toml").write_text(text, encoding="utf-8")
        if log.exists():
            head, played = log.read_bytes().split(b"\n", 1)
            begun = msgspec.json.decode(head, type=Session)
            begun = msgspec.structs.replace(begun, task=read(tmp_path / "task.toml"))
            log.write_bytes(msgspec.json.encode(begun) + b"\n" + played)

    def until(what: str, seen: Callable[[str], object], number: signal.Signals) -> None:
        process = study(rig, *run)
        wait_for(what, lambda: log.exists() and seen(log.read_text(encoding="utf-8")))
        process.send_signal(number)
        done(process, 0 if number == signal.SIGINT else -number)

    lasting(240, 60.0)
    until("three strikes", lambda text: text.count('"osc","counts":true') >= 3, signal.SIGKILL)
    lasting(8, 60.0)
    before = log.read_bytes()
    until("the second block", lambda text: '"type":"end"' in text and '"block":2' in text, signal.SIGINT)
    assert log.read_bytes().startswith(before)
    lasting(8, 1.5)
    done(study(rig, *run))
    records = [msgspec.json.decode(line) for line in log.read_bytes().splitlines()]
    begun = [(each["block"], each["attempt"]) for each in records if each["type"] == "block"]
    assert begun == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert [each["block"] for each in records if each["type"] == "end"] == [1, 2]
    assert [oct(path.stat().st_mode & 0o777) for path in (log, log.parent)] == ["0o600", "0o700"]
    done(study(rig, "export", folder, "--out", tmp_path / "study.csv"))
    kept = [row for row in rows(tmp_path / "study.csv") if (row["block"], row["attempt"]) == ("1", "1")]
    assert len([row for row in kept if row["counts"] == "true"]) >= 3
    assert {row["whole"] for row in kept} == {"false"}
    assert "deleted, 1 sessions" in done(study(rig, "forget", folder, "p01"))
    assert os.listdir(folder) == []


def test_without_a_rig_it_says_so_and_makes_no_file(rig: Rig, tmp_path: Path) -> None:
    (tmp_path / "task.toml").write_text(TASK, encoding="utf-8")
    nowhere = ["--rig", "nobody", "--connect", rig.endpoint, "--folder", str(tmp_path / "study")]
    command = [*DRUMSTICK, "study", "run", "--player", "p01", "--task", str(tmp_path / "task.toml"), *nowhere]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    assert ran.returncode == 3
    assert "is a rig of that name running?" in ran.stderr
    assert not (tmp_path / "study").exists()
