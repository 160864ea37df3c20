"""`drumstick audio-test` on the null device, on JACK's dummy driver, and where it cannot be."""

import json
import subprocess
from typing import Any

import pytest
from jack_server import Jack

PLAYING = ("--scene", "roll", "--seconds", "0.5")


def run(environment: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["drumstick", "audio-test", *PLAYING, *words],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        timeout=200.0,
    )


def found(environment: dict[str, str], *words: str) -> dict[str, Any]:
    done = run(environment, "--json", *words)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def check_row(row: dict[str, Any], rate_Hz: int) -> None:
    """Relations of a row that hold on any machine, however busy."""
    assert row["block_ms"] == pytest.approx(1e3 * row["block"] / rate_Hz, rel=1e-3)
    assert 0.0 < row["share_p50"] <= row["share_p99"] <= row["share_worst"]
    assert 0 <= row["late_ours"] <= row["late"] < row["blocks"]
    assert 0 <= row["xruns_ours"] <= row["xruns"]
    delay = row["delay_ms"]
    assert row["device_ms"] <= delay["least"] <= delay["typical"] <= delay["most"]


def test_on_the_null_device(own_folders: dict[str, str]) -> None:
    told = found(own_folders, "--audio", "null", "--audio-block", "1024", "--audio-block", "128")
    assert (told["scene"], told["device"], told["rate_Hz"]) == ("roll", "null", 48_000)
    assert (told["only_block"], told["priority_granted"], told["refused"]) == (None, 0, [])
    assert told["strikes_per_s"] >= 23.0
    assert [row["block"] for row in told["rows"] if row["granted"]] == [1024, 128]
    for row in told["rows"]:
        check_row(row, 48_000)
        assert row["real_time"] == (not row["granted"])  # null has an ordinary thread; to compare, the other
        assert row["priority"].startswith("SCHED_FIFO" if row["real_time"] else "ordinary")
    fitting = [row["block"] for row in told["rows"] if row["fits"] and row["granted"]]
    if fitting:
        assert told["recommended"]["block"] == min(fitting)
        assert len(told["perceived"]) == 2
    assert len(told["advice"]) >= 2
    assert told["real_time_can_be_had"] == any(row["real_time"] for row in told["rows"])


def test_in_words(own_folders: dict[str, str]) -> None:
    done = run(own_folders, "--audio", "null", "--audio-block", "512")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("scene roll on null at 48000 Hz: mesh of")
    assert any(line.startswith("   512  10.7  ordinary ") for line in lines)
    assert any(line.startswith("priority: ") for line in lines)
    assert "2.9 ms for each metre" in " ".join(done.stdout.split())


@pytest.mark.needs("jackd")
def test_jack_has_one_block_for_all(jack: Jack) -> None:
    told = found(jack.environment, "--audio", "auto")
    assert (told["only_block"], {row["block"] for row in told["rows"]}) == (128, {128})
    assert "JACK" in told["device"]
    for row in told["rows"]:
        check_row(row, 48_000)
        assert row["device_ms"] > row["block_ms"]
    refused = run(jack.environment, "--audio", "auto", "--audio-block", "64")
    assert refused.returncode == 3
    assert "JACK plays in blocks of 128 frames" in refused.stderr
    assert "jack_bufsize 64" in refused.stderr


@pytest.mark.needs("jackd")
@pytest.mark.long
def test_what_one_block_is_refused_for_is_told_beside_the_others(jack: Jack) -> None:
    both = found(jack.environment, "--audio", "jack audio", "--audio-block", "64", "--audio-block", "128")
    assert {row["block"] for row in both["rows"]} == {128}
    assert [one["block"] for one in both["refused"]] == [64]


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("--audio", "no such device"), 3, "no audio output device is called 'no such device'"),
        (("--audio", "wav:x.wav"), 2, "a file is never late"),
        (("--audio", "null", "--audio-block", "8"), 2, "--audio-block 8"),
        (("--audio", "null", "--seconds", "0"), 2, "--seconds 0"),
        (("--audio", "null", "--scene", "nowhere"), 2, "nowhere"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(
    own_folders: dict[str, str], words: tuple[str, ...], status: int, said: str
) -> None:
    done = run(own_folders, *words)
    assert (done.returncode, done.stdout) == (status, "")
    assert said in done.stderr.splitlines()[-1]
