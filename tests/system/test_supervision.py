"""Notices of each process to systemd: ready when it works, fed only while its own loop turns."""

import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rig_process import free_port, leave, wait_for
from supervised import WATCHDOG_S, Supervised, fifo_threads, hung, supervised

from haptic_server import files


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("machine")
    with pytest.MonkeyPatch.context() as patch:
        for variable in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
            (folder / variable).mkdir(mode=0o700)
            patch.setenv(variable, str(folder / variable))
        patch.delenv("NOTIFY_SOCKET", raising=False)
        yield folder


@pytest.fixture(scope="module")
def router() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture(scope="module")
def servo(place: Path) -> Iterator[Supervised]:
    with supervised(place, "servo", "--scene", "roll") as started:
        started.ready()
        yield started


@pytest.fixture(scope="module")
def gateway(place: Path, servo: Supervised, router: str) -> Iterator[Supervised]:
    osc = [
        "--osc-in",
        str(free_port()),
        "--osc-out",
        f"127.0.0.1:{free_port()}",
    ]
    with supervised(place, "gateway", "--listen", router, *osc) as started:
        started.ready()
        yield started


def test_the_force_loop_is_fed_while_it_ticks_and_only_then(servo: Supervised) -> None:
    servo.fed(3)
    servo.says("strikes")
    (loop,) = fifo_threads(servo.process.pid)

    def no_more() -> bool:
        # On a busy machine the loop may have stood still before, and ticked again. Systemd would have ended it by now.
        at_s, words, _ = servo.told[-1]
        return "has not ticked" in words and time.monotonic() > at_s + 3.0 * WATCHDOG_S

    with hung(loop):
        wait_for("the last words of the main thread, which lives, and then nothing", no_more)
        assert servo.process.poll() is None
    servo.fed(3)
    assert servo.count("READY=1") == 1


@pytest.mark.long
def test_the_gateway_is_fed(gateway: Supervised) -> None:
    gateway.fed(2)
    gateway.says("playing", "ready", "fault")


@pytest.mark.long
def test_another_scene_is_taken_up_at_the_next_start(
    place: Path, router: str, gateway: Supervised, servo: Supervised
) -> None:
    # What drumstick-scene@.service does, with a scene that no device can play: status 2 or 3, and the one before again.
    (run,) = (place / "XDG_RUNTIME_DIR").iterdir()
    gateway.close()
    servo.close()
    assert (run / files.BLOCK).exists()  # a crash would go on from there
    recorded = place / "still.csv"
    recorded.write_text("t_s,z_m\n" + "\n".join(f"{0.001 * tick:.3f},0.02" for tick in range(2000)) + "\n")
    device = ["--scene", "phantom", "--device", f"replay:{recorded}"]
    with supervised(place, "servo", *device) as first:
        first.ready()
    leave(run / files.WANTED, "roll")
    with supervised(place, "servo", *device) as second:
        status = second.ended()
    assert status in (2, 3), second.lines
    with supervised(place, "servo-ended", "exited", str(status)) as after:
        assert after.ended() == 0, after.lines
    with supervised(place, "servo", *device) as third:
        third.ready()
        assert 'name = "phantom"' in (run / files.SCENE).read_text()


@pytest.mark.long
def test_sound_is_ready_and_fed_though_there_is_no_router_yet(place: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with supervised(place, "sound", "--audio", "null", "--connect", endpoint) as sound:
        sound.ready()
        sound.fed(3)
        sound.says("waiting for the router")


@pytest.mark.long
def test_sound_waits_for_its_device_and_says_so(place: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with supervised(place, "sound", "--audio", "organ", "--connect", endpoint) as sound:
        sound.ready()
        sound.fed(3)
        sound.says("waiting for organ")
        wait_for("the line", lambda: "no audio until organ is available" in "\n".join(sound.lines))


@pytest.mark.long
def test_the_panel_is_ready_when_it_can_be_visited_and_then_fed(place: Path) -> None:
    port, endpoint = free_port(), f"tcp/127.0.0.1:{free_port()}"
    with supervised(place, "panel", "--panel-port", str(port), "--connect", endpoint) as panel:
        panel.ready()
        socket.create_connection(("127.0.0.1", port), timeout=60.0).close()
        panel.fed(2)


def test_a_gateway_without_a_servo_says_what_to_start(place: Path) -> None:
    with supervised(place, "gateway", "--rig", "nobody") as alone:
        assert alone.ended() == 3
    assert "start that first" in "\n".join(alone.lines)


def test_a_door_that_nobody_asked_for_is_a_mistake(place: Path) -> None:
    with supervised(place, "door") as door:
        assert door.ended() == 2
    assert "zenoh.public" in "\n".join(door.lines)
