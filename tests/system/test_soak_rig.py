"""`drumstick soak --real-time`: the machinery, for a minute at twenty times the strikes; not its slopes."""

import csv
import json
import os
import signal
import subprocess
from pathlib import Path

import pytest
from rig_process import DRUMSTICK, PATIENCE_S, children_of, is_alive, services_of, wait_for

pytestmark = pytest.mark.real_clock
SERVICES = {"supervisor", "servo", "gateway", "sound_server", "web_panel", "recording"}
COMPANIONS = {"osc companion", "zenoh companion", "visitor companion"}


@pytest.mark.timeout(1800)
@pytest.mark.long
def test_the_whole_rig_is_watched_at_twenty_times_the_strikes(tmp_path: Path) -> None:
    command = [*DRUMSTICK, "soak", "--real-time", "--duration", "60", "--json", "--out", str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=1500, check=False)
    # 1: some slope of a minute; the machinery is the same.
    assert ended.returncode in (0, 1), ended.stderr
    told = json.loads(ended.stdout)
    assert told["passed"] is (ended.returncode == 0)
    assert told["strikes_per_s"] > 30.0, "more than the scene's own 23, on any machine"
    rows = {row["name"]: row for row in told["quantities"]}
    for who in SERVICES | COMPANIONS:
        assert {f"{who} {what}" for what in ("rss_kB", "descriptors", "threads")} <= rows.keys()
    for counted in ("restarts", "zenoh again", "osc again", "refused by sound", "companions unheard"):
        assert rows[counted]["passed"], rows[counted]
    assert told["counts"]["zenoh"]["heard"] > 1000
    assert told["counts"]["osc"]["heard"] > 1000
    assert told["counts"]["visitor"]["answers"] >= 5
    with (tmp_path / "soak.csv").open(newline="") as stream:
        sampled = list(csv.DictReader(stream))
    assert {row["who"] for row in sampled} == SERVICES | COMPANIONS | {"rig"}
    assert {row["what"] for row in sampled if row["who"] == "rig"} >= {"lateness_p99_us", "arrival_ms"}
    assert all(float(row["value"]) > 0.0 for row in sampled if row["what"] == "pss_kB")
    assert (tmp_path / "soak.png").stat().st_size > 10_000


@pytest.mark.long
@pytest.mark.timeout(1800)
def test_a_soak_that_is_stopped_leaves_no_process_behind(tmp_path: Path) -> None:
    soaking = subprocess.Popen(
        [*DRUMSTICK, "soak", "--real-time", "--duration", "60"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=dict(os.environ, TMPDIR=str(tmp_path)),
    )

    def rig_and_services() -> list[int]:
        """Once there are some: before that it may not yet hear a signal."""
        assert soaking.poll() is None
        for rig in children_of(soaking.pid):
            if services := services_of(rig):
                return [rig, *services.values()]
        return []

    found = wait_for("a rig with services", rig_and_services)
    soaking.send_signal(signal.SIGTERM)
    soaking.communicate(timeout=PATIENCE_S)
    assert not any(is_alive(pid) for pid in found)
    assert list(tmp_path.iterdir()) == []
