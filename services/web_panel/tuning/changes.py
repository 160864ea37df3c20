"""Every change that a browser asks for: sent in order, remembered for undo and compare, explained when refused.

Browsers' requests come on viser's threads, which never wait here but for `load`; answers are taken by the main thread,
and so are undo, redo, A and B: each after the answers to all that was asked before it, for it acts on what they leave,
and after no more than that: another browser's drag and a roll that is sought for seconds go on meanwhile.
"""

from collections import deque
from collections.abc import Callable
from functools import partial

from drumstick.scenes.table import Z_H0
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState
from web_panel.rig.set_request import ROLL, SetRequest
from web_panel.tuning.compare import SLOTS, Compare, settable
from web_panel.tuning.set_queue import SetQueue
from web_panel.tuning.undo import UndoHistory
from web_panel.tuning.undo_file import UndoFile

UNDO, REDO, PRESET = "undo", "redo", "preset"
_WRITE_EVERY_S = 0.5


class Changes:
    """`set_` and `load_preset` ask the haptic server and wait; `lease_of` gives a browser's lease, "" without.

    `predict_roll` is given the whole set that each request would make, and must not block. `kept`: where undo, A and B
    outlive the panel.
    """

    def __init__(
        self,
        set_: Callable[[SetRequest], Answer],
        load_preset: Callable[[str, str], Answer],
        lease_of: Callable[[int | None], str],
        predict_roll: Callable[[dict[str, float]], None],
        kept: UndoFile,
    ) -> None:
        self._queue = SetQueue(set_)
        self._rolls = SetQueue(set_)  # its own, for the first roll may take seconds, and sets go on meanwhile
        self._load_preset = load_preset
        self._lease_of = lease_of
        self._predict_roll = predict_roll
        # Each with the newest request in either queue when it was pressed.
        self._steps: deque[tuple[int, int, Callable[[], None]]] = deque()
        self._stepped = 0  # request of the step before
        self._standing: dict[str, float] = {}  # replaced, never written: viser's threads read it
        self.history = UndoHistory()
        self.compare = Compare()
        self.words, self.alarm = "", False  # about the last whole set
        self.roll_words = ""  # about the last rate or level
        self._scenes_seen = 0
        self._kept = kept
        self._unwritten, self._write_at = False, 0.0

    def start(self) -> None:
        """Begin to ask."""
        self._queue.start()
        self._rolls.start()

    def close(self) -> None:
        """End after the question under way."""
        self._queue.close()
        self._rolls.close()

    def want_one(self, name: str, value: float, client: int | None) -> None:
        """Ask for one value. Never blocks."""
        self._queue.want(SetRequest({name: value}, self._lease_of(client), before=self._standing))
        self._predict_roll(self._with(name, value))

    def want_roll(self, name: str, value: float, client: int | None) -> None:
        """Ask for a "rate", Hz, or a "level" of the roll. Never blocks."""
        self._rolls.want(SetRequest({name: value}, self._lease_of(client), ROLL, self._standing))

    def refuse(self, name: str, value: float, reason: str) -> None:
        """Answer a request that need not be sent. Never blocks."""
        self._queue.refuse(SetRequest({name: value}), reason)

    def _with(self, name: str, value: float) -> dict[str, float]:
        values = settable(self._standing)
        if name == Z_H0:
            values.pop("z_ss", None)
        return {**values, name: value}

    def _press(self, act: Callable[[], None]) -> None:
        self._steps.append((self._queue.newest, self._rolls.newest, act))

    def undo(self, client: int | None) -> None:
        """Take the newest step back, if there is one. Never blocks."""
        self._press(partial(self._undo, client))

    def _undo(self, client: int | None) -> None:
        if self.history.back:
            self._want_all(self.history.back[-1].before, UNDO, client)

    def redo(self, client: int | None) -> None:
        """Do the step that was undone last again. Never blocks."""
        self._press(partial(self._redo, client))

    def _redo(self, client: int | None) -> None:
        if self.history.forth:
            self._want_all(self.history.forth[-1].after, REDO, client)

    def switch(self, slot: str, client: int | None) -> None:
        """Switch to the set in A or B, if it holds one. Never blocks."""
        self._press(partial(self._switch, slot, client))

    def _switch(self, slot: str, client: int | None) -> None:
        if slot in self.compare.slots:
            self._want_all(self.compare.slots[slot], slot, client)

    def switch_over(self, client: int | None) -> None:
        """Switch to the one of A and B that is not on. Never blocks."""
        self._press(lambda: self._switch(SLOTS[1] if self.compare.on == SLOTS[0] else SLOTS[0], client))

    def store(self, slot: str) -> None:
        """Keep what was accepted last in A or B. Never blocks."""
        self._press(partial(self._store, slot))

    def _store(self, slot: str) -> None:
        self.compare.store(slot, self._standing)
        self._unwritten = True

    def _want_all(self, values: dict[str, float], purpose: str, client: int | None) -> None:
        self._queue.want(SetRequest(dict(values), self._lease_of(client), purpose, self._standing))
        self._stepped = self._queue.newest

    def load(self, name: str, client: int | None) -> Answer:
        """Load a preset; waits for the answer."""
        before = self._standing
        answer = self._load_preset(name, self._lease_of(client))
        values = {parameter: readback.value for parameter, readback in answer.readbacks.items()}
        if values:
            self._queue.answers.put((SetRequest(values, purpose=PRESET, before=before), answer))
        return answer

    def take_answers(self, rig_state: RigState, now: float) -> list[tuple[SetRequest, Answer]]:
        """Note what was answered since the last call; the answers to single controls, which show them in place."""
        if rig_state.scene is not None and rig_state.scenes_seen != self._scenes_seen:
            self.history, self.compare = self._kept.read(rig_state.scene)
            self._scenes_seen = rig_state.scenes_seen
            self._steps.clear()  # they meant the scene before
            self.words = self.roll_words = ""
        single: list[tuple[SetRequest, Answer]] = []
        is_due = self._step_is_due()  # before the answers are taken: none is missed
        for answers in (self._queue.answers, self._rolls.answers):
            while not answers.empty():
                request, answer = answers.get()
                for name, readback in answer.readbacks.items():
                    rig_state.note_accepted(name, readback)
                self._note(request, answer, now)
                if not request.purpose:
                    single.append((request, answer))
        self._standing = rig_state.standing()
        if is_due:
            *_, act = self._steps.popleft()
            act()
        if rig_state.scene is not None and self._unwritten and now >= self._write_at:
            self._unwritten, self._write_at = False, now + _WRITE_EVERY_S
            self._kept.write(rig_state.scene, self.history, self.compare)
        return single

    def _step_is_due(self) -> bool:
        if not self._steps:
            return False
        set_, roll, _ = self._steps[0]
        return self._queue.has_answered(max(set_, self._stepped)) and self._rolls.has_answered(roll)

    def _note(self, request: SetRequest, answer: Answer, now: float) -> None:
        if request.purpose == ROLL:
            self.roll_words = answer.words
        elif request.purpose:
            self.words, self.alarm = answer.words, not answer.taken
        else:
            self.words = ""
        if not answer.taken:
            return
        self._unwritten = True
        after = {name: readback.value for name, readback in answer.readbacks.items()}
        if request.purpose == UNDO:
            self.history.undone(request.values)
        elif request.purpose != REDO or not self.history.redone(request.values):
            self.history.note(request.before, after, now, dragged=request.purpose == ROLL)
        if request.purpose in SLOTS:
            self.compare.switched(request.purpose)
