"""The virtual form of `drumstick soak`: what does not grow passes, a small leak of memory or descriptors does not."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import shipped_text
from drumstick_lab.soak import virtual
from drumstick_lab.soak.quicker import quicker
from drumstick_lab.soak.result import Result
from drumstick_lab.soak.samples import Samples
from realtime.stop import StopRequest

SPEED, SPAN_S = 20.0, 25.0
# What is kept for a while fills up in the first half minute and then rises and falls: judged over several such times.
WHOLE_SPAN_S = 150.0
LEAKED_BYTES, DESCRIPTOR_EVERY = 120, 500  # each strike; strikes

pytestmark = pytest.mark.long


def soaked(place: Path, also: virtual.Take | None = None) -> Result:
    text = quicker(shipped_text("roll"), "roll", SPEED)
    return virtual.soak(text, SPAN_S, SPEED, place, Samples(), lambda words: None, StopRequest(), also)


@pytest.mark.timeout(1200)
def test_a_rig_in_virtual_time_passes_and_is_told_whole(tmp_path: Path) -> None:
    """In a process of its own, as it is used: what a test runner allocates is none of the rig's growth."""
    command = [sys.executable, "-c", "from rig.cli.command import main; main()", "soak", "--json"]
    command += ["--duration", str(WHOLE_SPAN_S), "--speed", str(SPEED), "--out", str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    told = json.loads(ended.stdout)
    failed = [row["name"] for row in told["quantities"] if row["passed"] is False]
    assert failed in ([], ["rss_kB"]), failed
    assert (ended.returncode == 0) == told["passed"] == (not failed)
    # In so short a run the allocator's last steps look like growth: seen were 0.9 MB in the second half. Hours decide.
    with (tmp_path / "soak.csv").open(encoding="utf-8") as file:
        sizes = [float(row["value"]) for row in csv.DictReader(file) if row["what"] == "rss_kB"]
    later = sizes[len(sizes) // 2 :]
    assert max(later) - later[0] < 3000.0
    assert told["strikes"] == pytest.approx(WHOLE_SPAN_S * SPEED * 23.05, rel=0.02)
    names = {row["name"] for row in told["quantities"]}
    assert names >= {
        "rss_kB",
        "python_blocks",
        "descriptors",
        "threads",
        "clock map",
        "deduplication",
        "cycle",
    }
    assert json.loads((tmp_path / "soak.json").read_text())["quantities"] == told["quantities"]
    rows = (tmp_path / "soak.csv").read_text().splitlines()
    assert rows[0] == "t_s,who,what,value"
    assert len(rows) > 5 * virtual.SAMPLES
    assert (tmp_path / "soak.png").stat().st_size > 10_000


@pytest.mark.timeout(300)
def test_a_small_leak_of_memory_and_one_of_descriptors_are_caught(tmp_path: Path) -> None:
    kept: list[bytes] = []
    opened: list[int] = []

    def leak(payload: bytes) -> None:
        kept.append(bytes(LEAKED_BYTES))
        if len(kept) % DESCRIPTOR_EVERY == 0:
            opened.append(os.open(os.devnull, os.O_RDONLY))

    try:
        result = soaked(tmp_path, leak)
    finally:
        for descriptor in opened:
            os.close(descriptor)
    found = {verdict.name: verdict for verdict in result.verdicts}
    assert not result.passed
    assert [
        name for name, verdict in found.items() if verdict.passed is False and verdict.slope is None
    ] == []
    per_h = len(kept) / SPAN_S * 3600.0
    for name, leaked in (("python_blocks", per_h), ("descriptors", per_h / DESCRIPTOR_EVERY)):
        verdict = found[name]
        assert verdict.passed is False, verdict.words
        assert verdict.slope is not None
        assert verdict.slope.per_h == pytest.approx(leaked, rel=0.3)
    assert found["threads"].passed
