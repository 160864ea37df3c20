"""`drumstick up`: all four real processes together, and what happens when one of them dies."""

import json
import os
import signal
import subprocess
import sys
import wave
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zenoh
from browser import part, visitor
from osc_port import OscPort
from playwright.sync_api import Browser, expect
from rig_process import (
    DRUMSTICK,
    LOOPBACK,
    PATIENCE_S,
    Listener,
    Rig,
    ask,
    assert_steady,
    bound,
    is_alive,
    running,
    stood_still_s,
    wait_for,
)

from haptic_server.servo.stall_detector import StallDetector
from protocol.messages import Meter, Readback, State, Strike, decode

pytestmark = pytest.mark.system


def restarted(rig: Rig, module: str) -> None:
    """Kill a service outright and wait until the command has started another."""
    old = rig.children()[module]
    os.kill(old, signal.SIGKILL)
    wait_for(f"another {module}", lambda: rig.children().get(module, old) != old)


def latest(session: zenoh.Session, rig: Rig, good) -> State:
    states = Listener(session, rig.keys.state, State)
    return wait_for("a state", lambda: next((s for s in states.got if good(s)), None))


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with running("up") as started:
        yield started


@pytest.fixture(scope="module")
def page_address(rig: Rig) -> str:
    def find() -> str | None:
        return next((line.split("panel: ")[1] for line in rig.lines if "panel: http" in line), None)

    return wait_for("the panel's address", find)


def test_sound_plays_each_strike_once(rig: Rig, session: zenoh.Session) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    first = wait_for("a meter", lambda: next((m for m in meters.got if m.played > 0), None))
    strikes = Listener(session, rig.keys.strike, Strike)
    wait_for("thirty strikes", lambda: len(strikes.got) >= 30)
    later = wait_for(
        "later meter", lambda: next((m for m in meters.got if m.played >= first.played + 30), None)
    )
    assert later.duplicates == first.duplicates
    assert later.peak_left > 0.01
    assert later.peak_right > 0.01


@pytest.mark.needs("chromium")
@pytest.mark.long
def test_the_browser_changes_the_roll_and_shows_the_servos_value(
    rig: Rig, session: zenoh.Session, browser: Browser, page_address: str
) -> None:
    strikes = Listener(session, rig.keys.strike, Strike)
    wait_for("strikes", lambda: len(strikes.got) > 5)
    before = strikes.got[-1]
    echoes = Listener(session, rig.keys.param("dv_pls"), Readback)
    with closing(visitor(browser)) as context:
        page = context.new_page()
        page.goto(page_address)
        slider = page.get_by_role("slider").first
        slider.wait_for()
        expect(part(page, "notice")).to_contain_text("Playing")
        slider.focus()
        page.keyboard.press("End")
        echo = wait_for("the echo", lambda: next((e for e in echoes.got if e.value > 0.9), None))
        louder = wait_for(
            "louder strikes",
            lambda: next((s for s in strikes.got if s.z_speed_m_per_s > 1.5 * before.z_speed_m_per_s), None),
        )
        assert louder.seq > before.seq
        expect(page.get_by_text(f"{echo.value:g}", exact=False).first).to_be_visible()
    ask(session, rig.keys.set_one("dv_pls"), 0.2)


@pytest.mark.parametrize("module", ["sound_server", "web_panel", "haptic_server.gateway"])
@pytest.mark.daily("sound_server", "haptic_server*")
def test_a_killed_service_comes_back_and_the_servo_misses_nothing(
    rig: Rig, session: zenoh.Session, page_address: str, module: str
) -> None:
    # Settled: after a louder roll the rate climbs back for a second.
    before = latest(session, rig, lambda s: not s.pending and abs(s.v_e_m_per_s - 0.6278) < 1e-3)
    servo = rig.children()["haptic_server.servo"]
    meters = Listener(session, rig.keys.meter, Meter)
    old = wait_for("any meter", lambda: meters.got and meters.got[0].id)
    with StallDetector() as probes:
        restarted(rig, module)
        if module == "sound_server":
            wait_for(
                "sound again",
                lambda: any(m.id != old and m.played > 0 and m.peak_left > 0.01 for m in meters.got),
            )
        if module == "web_panel":
            wait_for(
                "the page again", lambda: page_address in rig.lines[-1] or rig.said.count(page_address) > 1
            )
        after = latest(session, rig, lambda s: s.strikes > before.strikes + 40)
    assert rig.children()["haptic_server.servo"] == servo
    assert after.boot == before.boot
    assert after.ring_dropped == 0
    assert_steady(before, after, stood_still_s(probes))


def test_a_fresh_start_opens_loopback_sockets_only_and_the_servo_none(rig: Rig, page_address: str) -> None:
    wait_for("the page", lambda: page_address)

    def looked() -> dict[str, list[str]]:
        # A service whose gateway, or which itself, was started anew has no socket while it tries to come in again.
        return {name: bound(pid) for name, pid in rig.children().items()}

    services = {"haptic_server.gateway", "sound_server", "web_panel"}
    addresses = wait_for(
        "a socket of each service",
        lambda: found if all((found := looked()).get(name) for name in services) else None,
    )
    assert addresses.pop("haptic_server.servo") == []
    assert addresses.keys() == services
    for name, found in addresses.items():
        assert all(address.partition(":")[0].endswith(LOOPBACK) for address in found), (name, found)


def test_the_commands_beside_it(rig: Rig, session: zenoh.Session) -> None:
    wire = ["--rig", rig.name, "--connect", rig.endpoint]

    def drumstick(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*DRUMSTICK, *words, *wire], capture_output=True, text=True, timeout=PATIENCE_S, check=False
        )

    done = drumstick("params", "set", "dv_pls=0.25", "k_coll=6000")
    assert done.returncode == 0, done.stderr
    wait_for("dv_pls", lambda: decode(ask(session, rig.keys.param("dv_pls")), Readback).value == 0.25)
    assert "k_coll = 6000" in drumstick("params", "get", "k_coll").stdout
    refused = drumstick("params", "set", "dv_pls=0.3", "tau=7")
    assert refused.returncode == 2
    assert "outside" in refused.stderr
    assert decode(ask(session, rig.keys.param("dv_pls")), Readback).value == 0.25
    assert drumstick("panic").returncode == 0
    latest(session, rig, lambda s: s.status == "panic")
    armed = subprocess.run(
        [*DRUMSTICK, "arm", "--rig", rig.name], capture_output=True, timeout=PATIENCE_S, check=False
    )
    assert armed.returncode == 0
    latest(session, rig, lambda s: s.status == "playing")
    assert drumstick("params", "set", "dv_pls=0.2", "k_coll=5000").returncode == 0

    def watched() -> dict[str, Any] | None:
        # Again where a busy machine needs the whole second to come in.
        done = drumstick("monitor", "--duration", "1", "--json")
        assert done.returncode == 0, done.stderr
        found = [json.loads(line)["announced"] for line in done.stdout.splitlines()]
        return next((each for each in found if each is not None and each["contacts"] > 5), None)

    announced = wait_for("contacts", watched)
    assert announced["good"]
    assert abs(announced["peak_median_dB"]) < 0.5
    assert abs(announced["impulse_median_dB"]) < 0.1


def test_a_short_run_ends_by_itself_with_a_summary_and_a_sound_file(tmp_path: Path) -> None:
    recorded = tmp_path / "roll.wav"
    with OscPort() as daw:
        heard_by = ["--osc-out", f"127.0.0.1:{daw.port}"]
        with running("up", "--duration", "3", "--json", "--audio", f"wav:{recorded}", *heard_by) as started:
            assert daw.receive("/drumstick/strike")[0] == 1, "whoever listens misses no strike of a start"
            children = started.children()
            assert "haptic_server.servo" in children
            summary = started.summary()
    assert 10.0 < summary["roll_rate_Hz"] < 40.0
    # A machine that stands still for longer than the stick is moved at once makes overruns, of a millisecond each.
    lasted_s, still_s = summary["duration_s"], 1e-3 * summary["overruns"]
    made = summary["strikes"] / summary["roll_rate_Hz"]
    assert lasted_s - still_s - 0.5 < made < lasted_s + 0.5
    assert summary["strikes_played"] > 0  # what comes too late is dropped: how many is the machine's affair
    assert set(summary["restarts"].values()) == {0}
    assert not any(is_alive(pid) for pid in children.values())
    with wave.open(str(recorded)) as file:
        rate, frames = file.getframerate(), file.readframes(file.getnframes())
    sound = np.frombuffer(frames, "<i2").reshape(-1, 2) / 32768.0
    assert len(sound) > 3 * rate
    assert np.sqrt(np.mean(sound[-2 * rate :] ** 2)) > 0.01
    spectrum = np.abs(np.fft.rfft(sound[-2 * rate :, 0] * np.hanning(2 * rate)))
    frequencies = np.fft.rfftfreq(2 * rate, 1 / rate)
    loudest = frequencies[np.argmax(spectrum)]
    assert 100.0 < loudest < 600.0, "the lower modes of a 150 Hz drum"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--scene", "nonsense"], "shipped: "),
        (["--scene", "/nowhere/at/all.toml"], "No such file"),
        (["--device", "falcon"], "simulated"),
        (["--duration", "nan"], "--duration"),
        (["--rig", "a/b"], "rig name"),
        (["--osc-out", "somewhere"], "host:port"),
        (["--prefix", "no slash"], "--prefix"),
        (["--osc-in", "0"], "--osc-in"),
        (["--audio", "wav:/nowhere/at/all.wav"], "all.wav"),
    ],
)
@pytest.mark.daily("words0*", "words7*")
def test_wrong_words_are_one_line_and_status_2(words: list[str], says: str) -> None:
    command = ["up", *words] if "--rig" in words else ["up", "--rig", f"wrong-{os.getpid()}", *words]
    if "--audio" in words:  # only the sound server can tell: keep it off this machine's ports
        command = ["sound", "--rig", f"wrong-{os.getpid()}", *words]
    ended = subprocess.run(
        [*DRUMSTICK, *command], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert ended.returncode == 2, ended.stderr
    assert says in ended.stderr
    assert "Traceback" not in ended.stderr
    assert ended.stdout == ""


@pytest.mark.long
def test_a_broken_scene_file_names_line_key_limit_and_unit(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text('name = "x"\n[stick]\nm_kg = 0.0\nstiffness = 3\n')
    ended = subprocess.run(
        [*DRUMSTICK, "up", "--scene", str(broken)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 2
    assert "broken.toml:3: stick.m_kg: 0.0 kg is outside 0.0001 .. 1 kg" in ended.stderr
    assert "broken.toml:4: stick.stiffness: unknown key" in ended.stderr
    broken.write_text("name = [\n")
    ended = subprocess.run(
        [*DRUMSTICK, "scene", "check", str(broken)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 2
    assert "not valid TOML" in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_doctor_speaks_json() -> None:
    import json

    told = subprocess.run(
        [*DRUMSTICK, "doctor", "--json"], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert told.returncode == 0, told.stdout
    findings = json.loads(told.stdout)
    assert findings["playable"] is True
    assert {"name", "good", "needed", "found", "remedy"} <= set(findings["findings"][0])


def test_help_imports_nothing_heavy() -> None:
    """Quickness of --help, without a clock: none of the heavy packages is imported for it."""
    code = (
        "import sys; sys.argv=['drumstick','--help']\n"
        "from rig.cli.command import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print(sorted({'numba','numpy','zenoh','viser','sounddevice','msgspec','cryptography'} & set(sys.modules)))"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE_S, check=True
    )
    assert told.stdout.strip().endswith("[]")
