"""Changes of a panel against a haptic server made of a dictionary."""

import time
from collections.abc import Callable
from pathlib import Path

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState
from web_panel.rig.set_request import SetRequest
from web_panel.tuning.changes import Changes
from web_panel.tuning.undo_file import UndoFile

SCENE = parse(shipped_text("roll"), "roll.toml")
TABLE = table_of(SCENE)
HOLDER, OTHER = 1, 2


class Rig:
    """Accepts what is not refused; and the panel's view of it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values = {"dv_pls": 0.2, "k_coll": 5000.0, "z_ss": -0.02, "z_h0": -0.0126}
        self.revision = 0
        self.refusal = ""
        self.asked: list[SetRequest] = []
        self.foreseen: list[dict[str, float]] = []
        self.now = 0.0
        self.rig_state = RigState()
        self.rig_state.note_scene(SCENE, TABLE)
        for name, value in self.values.items():
            self.rig_state.note_readback(name, Readback(value=value, revision=0))
        self.start_panel()

    def start_panel(self) -> None:
        """A panel as it starts, and the first that it hears."""
        self.changes = Changes(self.set, self.load, self.lease_of, self.foresee, UndoFile(self.path))
        self.changes.start()
        self.changes.take_answers(self.rig_state, self.now)

    def restart_panel(self) -> None:
        """As after a kill: nothing is said at the end."""
        self.changes.take_answers(self.rig_state, self.now + 5.0)
        self.changes.close()
        self.start_panel()

    def foresee(self, values: dict[str, float]) -> None:
        self.foreseen.append(values)

    def lease_of(self, client: int | None) -> str:
        return "secret" if client == HOLDER else ""

    def set(self, request: SetRequest) -> Answer:
        self.asked.append(request)
        if self.refusal:
            return Answer(reason=self.refusal, refused=True)
        self.values |= request.values
        self.revision += 1
        return Answer({n: Readback(value=v, revision=self.revision) for n, v in request.values.items()})

    def load(self, name: str, lease: str) -> Answer:
        return self.set(SetRequest({"dv_pls": 0.9}, lease, "preset"))

    def until(self, true: Callable[[], object]) -> None:
        """Take answers, each round five seconds later, until this is so."""
        end = time.monotonic() + 60.0
        while not true():
            assert time.monotonic() < end
            time.sleep(0.002)
            self.now += 5.0
            self.changes.take_answers(self.rig_state, self.now)

    def store(self, slot: str) -> None:
        self.changes.store(slot)
        self.until(lambda: slot in self.changes.compare.slots)

    def change(self, name: str, value: float) -> None:
        self.changes.want_one(name, value, OTHER)
        self.until(lambda: self.rig_state.readbacks[name].value == value)
