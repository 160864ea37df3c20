"""A wish for another scene, as `drumstick up` follows it: a latched fault keeps its servo, and so its words."""

from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block, files
from haptic_server.block_header import HELD
from realtime.atomics import poke
from rig.scene_file import SceneFiles
from rig.supervision.plan import Options
from rig.supervision.terminal import Terminal
from rig.supervision.up import Rig


class Child:
    """A service whose life is written down."""

    def __init__(self, name: str, life: list[str]) -> None:
        self.name, self.fault_status, self.last_line = name, None, ""
        self._life = life

    def ask_to_stop(self) -> None:
        self._life.append(f"{self.name} stops")

    def wait_stopped(self, deadline: float) -> bool:
        return deadline > 0.0

    def start_anew(self) -> None:
        self._life.append(f"{self.name} starts")

    def poll(self, now: float) -> None:
        assert now > 0.0


@pytest.mark.parametrize("is_held", [True, False])
def test_a_held_servo_keeps_running_and_so_keeps_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_held: bool
) -> None:
    life: list[str] = []
    said: list[str] = []
    roll = SceneFiles("roll", shipped_text("roll"))
    roll.put(tmp_path)
    made = block.create(tmp_path, law_of(parse(roll.text, "roll")))
    poke(made.control, HELD, int(is_held))
    rig = Rig(Options("main", tmp_path, tmp_path), roll, Terminal())
    monkeypatch.setattr(rig, "_services", [Child("servo", life), Child("gateway", life)])
    monkeypatch.setattr(rig, "_terminal", type("Said", (), {"say": staticmethod(said.append)}))
    (tmp_path / files.WANTED).write_text("tom")
    rig._poll(1.0)
    assert not (tmp_path / files.WANTED).exists()
    assert life == ([] if is_held else ["gateway stops", "servo stops", "servo starts", "gateway starts"])
    assert ("the scene stays; drumstick arm first" in said[-1]) == is_held
    assert (tmp_path / files.SCENE).read_text() == shipped_text("roll" if is_held else "tom")
