"""Another scene as systemd plays it (ExecReload of the force loop's unit), with a notify socket of the test's own.

The gateway is the same process before and after, and hears a panic meanwhile; the arm has one owner.
"""

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
import zenoh
from rig_process import DRUMSTICK, PATIENCE_S, Listener, ask, free_port, is_alive, leave, wait_for
from supervised import Supervised, supervised

from haptic_server import files
from protocol.keys import Keys
from protocol.messages import State
from protocol.session import open_client
from rig import folder
from rig.exit_status import CommandError

pytestmark = pytest.mark.system


class Unit:
    """A rig of two processes, and what systemd does with them."""

    def __init__(self, run: Path, servo: Supervised, session: zenoh.Session) -> None:
        self.run, self.servo, self.session, self.keys = run, servo, session, Keys("main")
        self.said = run.parent / "said"
        self.states = Listener(session, self.keys.state, State)

    @property
    def main_pid(self) -> int:
        """The process that systemd was told of last."""
        named = [words for _, words, _ in list(self.servo.told) if words.startswith("MAINPID=")]
        return int(named[-1].removeprefix("MAINPID=")) if named else self.servo.process.pid

    def begin_reload(self) -> subprocess.Popen[bytes]:
        with self.said.open("wb") as to:  # no pipe: the next servo has it too, and keeps it open
            return subprocess.Popen(
                [*DRUMSTICK, "service", "servo-reload", "--scene", "roll"],
                env={**self.servo.environment, "MAINPID": str(self.main_pid)},
                stderr=to,
            )

    def end(self, change: subprocess.Popen[bytes]) -> str:
        """Wait for its good end; what it said."""
        status, words = change.wait(240.0), self.said.read_text()
        assert status == 0, words
        return words

    def reload(self, scene: str) -> None:
        """Ask for a scene, as a technician does, and have it played."""
        ask(self.session, self.keys.scene_load, scene)
        self.end(self.begin_reload())

    def waiting(self) -> int:
        """Process of the servo that waits for its turn; 0: none yet."""
        for process in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):
                words = (process / "cmdline").read_text().split("\0")
                is_servo = words[1:3] == ["-m", "haptic_server.servo"] and str(self.run) in words[3]
                if is_servo and '"turn":-1' not in words[3] and int(process.name) != self.main_pid:
                    return int(process.name)
        return 0

    def state(self) -> State:
        """The next one."""
        seen = len(self.states.got)
        wait_for("a state", lambda: len(self.states.got) > seen)
        return self.states.got[-1]


def parent_of(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Unit]:
    place = tmp_path_factory.mktemp("machine")
    router = f"tcp/127.0.0.1:{free_port()}"
    osc = ["--osc-in", str(free_port()), "--osc-out", f"127.0.0.1:{free_port()}", "--listen", router]
    with pytest.MonkeyPatch.context() as patch:
        for variable in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
            (place / variable).mkdir(mode=0o700)
            patch.setenv(variable, str(place / variable))
        with supervised(place, "servo", "--scene", "roll") as servo:
            servo.ready()
            with supervised(place, "gateway", *osc) as gateway:
                gateway.ready()
                session = open_client(router, lambda: gateway.process.poll() is None)
                assert session is not None
                made = Unit(folder.run_folder("main"), servo, session)
                made.state()
                try:
                    yield made
                    assert gateway.process.poll() is None
                finally:
                    session.close()  # type: ignore[no-untyped-call]
                    if made.main_pid != servo.process.pid:
                        with suppress(ProcessLookupError):
                            os.kill(made.main_pid, signal.SIGTERM)


def test_the_servo_that_is_ready_follows_and_the_gateway_stays(unit: Unit) -> None:
    before, first = unit.state(), unit.main_pid
    unit.reload("tom")
    assert unit.servo.ended() == 0
    assert unit.main_pid != first
    wait_for("a state of the other servo", lambda: unit.state().boot != before.boot)
    assert 'name = "tom"' in (unit.run / files.SCENE).read_text()
    assert not (unit.run / files.NEXT).exists()
    fed = unit.servo.count("WATCHDOG=1")
    wait_for("the watchdog to be fed by the other servo", lambda: unit.servo.count("WATCHDOG=1") > fed + 2)
    with pytest.raises(
        CommandError, match="already running"
    ):  # it holds the rig's lock, as the first one did
        folder.claim(unit.run, "main")
    # And once more, from a servo that systemd did not start itself.
    second = unit.main_pid
    unit.reload("roll")
    assert unit.main_pid != second
    wait_for("its end", lambda: not is_alive(second))
    wait_for("its strikes", lambda: unit.state().strikes > 0)


def test_a_panic_while_a_scene_is_made_ready_keeps_the_scene(unit: Unit) -> None:
    before = unit.main_pid
    ask(unit.session, unit.keys.scene_load, "tom")
    change = unit.begin_reload()
    ahead = wait_for("the next servo", unit.waiting)
    assert parent_of(ahead) != change.pid  # systemd's child, or of whoever is there for it
    os.kill(ahead, signal.SIGSTOP)  # however slow this test is, it does not get ready before the panic
    ask(unit.session, unit.keys.panic)
    wait_for("the panic", lambda: unit.state().status == "panic")
    os.kill(ahead, signal.SIGCONT)
    assert "latched" in unit.end(change)
    wait_for(
        "the panic still", lambda: unit.state().status == "panic"
    )  # one that stands still has no word of it
    wait_for("the refusal", lambda: "latched" in unit.state().scene_refusal)
    leave(unit.run / files.WANTED, "tom")  # past the gateway, which refuses it in a panic
    assert "latched" in unit.end(unit.begin_reload())
    assert unit.main_pid == before
    assert is_alive(before)
    subprocess.run([*DRUMSTICK, "arm"], check=True, timeout=PATIENCE_S)
    wait_for("strikes", lambda: unit.state().status == "playing")


def test_a_scene_that_cannot_be_played_is_refused_and_the_present_one_plays_on(unit: Unit) -> None:
    before = unit.main_pid
    leave(unit.run / files.WANTED, "no-such-scene")
    unit.end(unit.begin_reload())
    wait_for("the refusal", lambda: "no-such-scene" in unit.state().scene_refusal)
    assert unit.main_pid == before
    assert is_alive(before)
    assert unit.end(unit.begin_reload()) == ""  # nobody asked


def test_a_servo_whose_turn_never_comes_ends_with_the_reload(unit: Unit) -> None:
    ask(unit.session, unit.keys.scene_load, "tom")
    change = unit.begin_reload()

    ahead = wait_for("the next servo", unit.waiting)
    change.kill()
    change.wait()
    wait_for("its end", lambda: not is_alive(ahead))
    assert is_alive(unit.main_pid)
    wait_for("play", lambda: unit.state().status == "playing")
