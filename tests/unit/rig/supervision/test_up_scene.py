"""A wish for another scene, as `drumstick up` follows it: ready beside the present one, and one owner of the arm."""

import os
import select
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block, files, set_list
from haptic_server.block import Block
from haptic_server.block_header import HELD, PANIC
from haptic_server.set_list import SetList
from realtime.atomics import poke
from rig import folder
from rig.exit_status import CommandError
from rig.scene_file import SceneFiles
from rig.supervision import start_progress, up
from rig.supervision.plan import Options
from rig.supervision.scenes.next_scene import NextScene
from rig.supervision.terminal import Terminal
from rig.supervision.up import Rig
from stability.catalogue import shows

PID = 4711


class Child:
    """A service whose life is written down, and what lies in the run folder at each step of it."""

    def __init__(
        self, name: str, _command: object, _say: object, _essential: bool = True, pass_fds: Sequence[int] = ()
    ) -> None:
        self.name, self.fault_status, self.last_line = name, None, ""
        self.pid: int | None = PID
        self.is_next = bool(pass_fds)
        TURN.extend(map(os.dup, pass_fds))  # as it is inherited
        self.who = "next" if self.is_next else name

    def _note(self, what: str) -> None:
        has_turn = bool(TURN) and select.select(TURN, [], [], 0.0)[0] and os.read(TURN[0], 1) == b"\n"
        scene = parse((RUN[0] / files.SCENE).read_text(), "scene").name
        LIFE.append(f"{self.who} {what}, {scene}{', turn' if has_turn else ''}")

    def start(self) -> None:
        self._note("starts")

    def ask_to_stop(self) -> None:
        self._note("stops")

    def wait_stopped(self, deadline: float, *, complain: bool = True) -> bool:
        return deadline > 0.0 and complain in (True, False)

    def start_anew(self) -> None:
        self._note("starts anew")

    def take_over(self, other: "Child") -> None:
        self._note(f"takes over {other.who}")

    def poll(self, now: float) -> None:
        assert now > 0.0


LIFE: list[str] = []
TURN: list[int] = []  # the pipe's end in the servo that waits
RUN: list[Path] = []


class Bench:
    """A rig of such services that plays `roll`, and a wish for `tom`."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        LIFE.clear()
        while TURN:
            os.close(TURN.pop())
        RUN[:] = [folder]
        self.said: list[str] = []
        self.folder = folder
        roll = SceneFiles("roll", shipped_text("roll"))
        roll.put(folder)
        self.block: Block = block.create(folder, law_of(parse(roll.text, "roll")))
        monkeypatch.setattr(up, "Service", Child)
        self.rig = Rig(Options("main", folder, folder), roll, Terminal())
        monkeypatch.setattr(self.rig, "_services", [Child("servo", ["x"], 0), Child("gateway", ["x"], 0)])
        said = type("Said", (), {"say": staticmethod(self.said.append)})
        monkeypatch.setattr(self.rig, "_terminal", said)
        (folder / files.WANTED).write_text("tom")

    def poll(self) -> None:
        self.rig._poll(1.0)

    def make_ready(self) -> None:
        for name in (files.SERVO_READY, files.GATEWAY_READY):
            (self.folder / files.NEXT / name).touch()


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    return Bench(tmp_path, monkeypatch)


def test_a_held_servo_keeps_running_and_so_keeps_its_words(bench: Bench) -> None:
    poke(bench.block.control, HELD, 1)
    bench.poll()
    assert not (bench.folder / files.WANTED).exists()
    assert LIFE == []
    assert "the scene stays; drumstick arm first" in bench.said[-1]


@shows("compile pause at a change of scene", "ours")
def test_the_next_servo_gets_its_turn_when_all_is_ready_and_the_one_before_has_stopped(bench: Bench) -> None:
    bench.poll()
    for missing in (files.GATEWAY_READY, files.SERVO_READY):
        bench.make_ready()
        (bench.folder / files.NEXT / missing).unlink()
        bench.poll()
    assert LIFE == ["next starts, roll"]
    bench.make_ready()
    bench.poll()
    assert LIFE[1:] == ["servo stops, roll", "servo takes over next, tom, turn"]
    assert not (bench.folder / files.NEXT).exists()


@pytest.mark.parametrize("cell", [HELD, PANIC])
def test_a_panic_while_the_next_servo_is_made_ready_stops_none_that_plays(bench: Bench, cell: int) -> None:
    bench.poll()
    bench.make_ready()
    poke(bench.block.control, cell, 1)
    bench.poll()
    assert LIFE[1:] == ["next stops, roll"]


@pytest.mark.parametrize("cell", [HELD, PANIC])
def test_a_panic_while_the_servo_stops_lets_the_next_one_be_held_at_once(
    bench: Bench, cell: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.poll()
    bench.make_ready()
    stop = Child.ask_to_stop

    def stop_in_panic(child: Child) -> None:
        stop(child)
        poke(bench.block.control, cell, 1)

    monkeypatch.setattr(Child, "ask_to_stop", stop_in_panic)
    bench.poll()
    assert LIFE[1:] == ["servo stops, roll", "servo takes over next, tom, turn"]


@pytest.fixture
def changed(bench: Bench) -> Bench:
    """After a change from `roll` to `tom`."""
    bench.poll()
    bench.make_ready()
    bench.poll()
    LIFE.clear()
    return bench


def test_a_scene_that_an_opened_arm_does_not_play_gives_way_to_the_one_before(changed: Bench) -> None:
    servo: Any = changed.rig._services[0]
    servo.fault_status = 3
    changed.poll()
    assert LIFE == ["servo starts anew, roll"]  # and the gateway plays on: it hears a panic
    with pytest.raises(CommandError):  # that one cannot be played either
        changed.poll()


def test_a_gateway_that_cannot_run_ends_the_rig_whatever_scene_was_before(changed: Bench) -> None:
    gateway: Any = changed.rig._services[1]
    gateway.fault_status = 2
    with pytest.raises(CommandError):
        changed.poll()
    assert LIFE == []


def test_the_status_line_tells_which_scene_is_made_ready_and_what_is_compiled_for_it(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(up, "store_folder", lambda: bench.folder / "kernels")
    monkeypatch.setattr(start_progress, "_LOOK_EVERY_S", 0.0)
    bench.poll()
    assert bench.rig._status_line("") == "next tom"
    (bench.folder / "kernels" / "mesh-1").mkdir(parents=True)
    (bench.folder / "kernels" / "mesh-1" / "step.nbc").touch()
    bench.poll()
    bench.poll()
    assert bench.rig._status_line("").startswith("next tom, compiling 1 of about ")


def test_what_cannot_be_made_ready_is_refused_and_touches_nothing(bench: Bench) -> None:
    bench.poll()
    ahead = bench.rig._next
    assert ahead is not None
    assert isinstance(ahead.service, Child)
    ahead.service.pid = None  # it ended
    bench.poll()
    bench.poll()
    assert LIFE[1:] == ["next stops, roll"]
    assert (bench.folder / files.REFUSED).read_text() == "the scene tom cannot be played here: roll plays on"
    assert not (bench.folder / files.NEXT).exists()


def test_a_next_servo_that_cannot_start_leaves_nothing_that_is_announced(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_process(_: Child) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(Child, "start", no_process)
    bench.poll()
    assert "cannot be made ready" in (bench.folder / files.REFUSED).read_text()
    assert not (bench.folder / files.NEXT).exists()
    assert bench.rig._next is None


def test_where_the_scene_cannot_be_put_the_one_before_starts_anew(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise CommandError(3, "no room")

    def broken(*_: object) -> None:
        raise OSError(5, "Input/output error")

    bench.poll()
    bench.make_ready()
    monkeypatch.setattr(NextScene, "put", broken)
    monkeypatch.setattr(SceneFiles, "put", full)
    bench.poll()
    assert LIFE[1:] == ["servo stops, roll", "next stops, roll", "servo starts anew, roll"]
    assert "Input/output error" in (bench.folder / files.REFUSED).read_text()


def test_a_full_place_is_not_met_after_the_force_has_ended(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.poll()
    bench.make_ready()

    def full(*_: object) -> None:
        raise CommandError(3, "no room")

    monkeypatch.setattr(folder, "put_text", full)
    bench.poll()
    assert LIFE[1:] == ["servo stops, roll", "servo takes over next, tom, turn"]


def test_a_scene_of_the_set_list_whose_file_has_gone_is_refused_to_whoever_asked(bench: Bench) -> None:
    (bench.folder / files.SET_LIST).write_text(SetList(("roll", "/gone/mine.toml")).text())
    (bench.folder / files.WANTED).write_text("1")
    bench.poll()
    assert "/gone/mine.toml" in (bench.folder / files.REFUSED).read_text()
    assert LIFE == []


def test_an_older_refusal_goes_before_the_newer_wish(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """A gateway that met it without that wish would take it for the wish's own."""
    (bench.folder / files.REFUSED).write_text("too hard")
    left: list[bool] = []
    replace = Path.replace

    def watched(path: Path, to: Path) -> Path:
        if path.name == files.WANTED:
            left.append((bench.folder / files.REFUSED).exists())
        return replace(path, to)

    monkeypatch.setattr(Path, "replace", watched)
    bench.poll()
    assert left[0] is False
    assert bench.rig._next is not None


def test_a_newer_wish_takes_the_place_of_one_that_is_not_ready(bench: Bench) -> None:
    bench.poll()
    (bench.folder / files.WANTED).write_text("snare")
    bench.poll()
    assert LIFE == ["next starts, roll", "next stops, roll", "next starts, roll"]
    assert parse((bench.folder / files.NEXT / files.SCENE).read_text(), "next").name == "snare"


@pytest.mark.parametrize("panics", [True, False])
def test_the_set_list_moves_when_the_scene_has_changed_and_not_before(bench: Bench, panics: bool) -> None:
    (bench.folder / files.SET_LIST).write_text(SetList(("roll", "tom")).text())
    (bench.folder / files.WANTED).write_text("1")
    bench.poll()
    bench.make_ready()
    before = set_list.read(bench.folder)
    assert before is not None
    assert before.at == 0
    if panics:
        poke(bench.block.control, PANIC, 1)
    bench.poll()
    after = set_list.read(bench.folder)
    assert after is not None
    assert after.at == (0 if panics else 1)
