"""Every change that a browser asks for: sent in order, remembered for undo and compare, explained when refused.

Browsers' wishes come on viser's threads, which never wait here but for `load`; answers are taken by the main thread.
"""

from collections.abc import Callable

from drumstick.parameters.table import Z_H0
from web_panel.rig.answer import Answer
from web_panel.rig.mirror import Mirror
from web_panel.tuning.compare import SLOTS, Compare, settable
from web_panel.tuning.kept import Kept
from web_panel.tuning.undo import History
from web_panel.tuning.wishes import Wish, Wishes

UNDO, REDO, PRESET = "undo", "redo", "preset"
_WRITE_EVERY_S = 0.5


class Changes:
    """`set_` and `load_preset` ask the haptic server and wait; `lease_of` gives a browser's lease, "" without.

    `foresee` is given the whole set that each single wish would make, and must not block. `kept`: where undo, A and B
    outlive the panel.
    """

    def __init__(
        self,
        set_: Callable[[Wish], Answer],
        load_preset: Callable[[str, str], Answer],
        lease_of: Callable[[int | None], str],
        foresee: Callable[[dict[str, float]], None],
        kept: Kept,
    ) -> None:
        self._wishes = Wishes(set_)
        self._load_preset = load_preset
        self._lease_of = lease_of
        self._foresee = foresee
        self._standing: dict[str, float] = {}  # replaced, never written: viser's threads read it
        self.history = History()
        self.compare = Compare()
        self.words, self.alarm = "", False  # about the last whole set
        self._scenes_seen = 0
        self._kept = kept
        self._unwritten, self._write_at = False, 0.0

    def start(self) -> None:
        """Begin to ask."""
        self._wishes.start()

    def close(self) -> None:
        """End after the question under way."""
        self._wishes.close()

    def want_one(self, name: str, value: float, client: int | None) -> None:
        """Ask for one value. Never blocks."""
        self._wishes.want(Wish({name: value}, self._lease_of(client), before=self._standing))
        self._foresee(self._with(name, value))

    def refuse(self, name: str, value: float, reason: str) -> None:
        """Answer a wish that need not be sent. Never blocks."""
        self._wishes.refuse(Wish({name: value}), reason)

    def _with(self, name: str, value: float) -> dict[str, float]:
        values = settable(self._standing)
        if name == Z_H0:
            values.pop("z_ss", None)
        return {**values, name: value}

    def undo(self, client: int | None) -> None:
        """Take the newest step back, if there is one. Never blocks."""
        if self.history.back:
            self._want_all(self.history.back[-1].before, UNDO, client)

    def redo(self, client: int | None) -> None:
        """Do the step that was undone last again. Never blocks."""
        if self.history.forth:
            self._want_all(self.history.forth[-1].after, REDO, client)

    def switch(self, slot: str, client: int | None) -> None:
        """Switch to the set in A or B, if it holds one. Never blocks."""
        if slot in self.compare.slots:
            self._want_all(self.compare.slots[slot], slot, client)

    def switch_over(self, client: int | None) -> None:
        """Switch to the one of A and B that is not on."""
        self.switch(SLOTS[1] if self.compare.on == SLOTS[0] else SLOTS[0], client)

    def store(self, slot: str) -> None:
        """Keep what was accepted last in A or B."""
        self.compare.store(slot, self._standing)
        self._unwritten = True

    def _want_all(self, values: dict[str, float], purpose: str, client: int | None) -> None:
        self._wishes.want(Wish(dict(values), self._lease_of(client), purpose, self._standing))

    def load(self, name: str, client: int | None) -> Answer:
        """Load a preset; waits for the answer."""
        before = self._standing
        answer = self._load_preset(name, self._lease_of(client))
        values = {parameter: readback.value for parameter, readback in answer.readbacks.items()}
        if values:
            self._wishes.answers.put((Wish(values, purpose=PRESET, before=before), answer))
        return answer

    def take_answers(self, mirror: Mirror, now: float) -> list[tuple[Wish, Answer]]:
        """Note what was answered since the last call; the answers to single controls, which show them in place."""
        if mirror.scene is not None and mirror.scenes_seen != self._scenes_seen:
            self.history, self.compare = self._kept.read(mirror.scene)
            self._scenes_seen = mirror.scenes_seen
            self.words = ""
        single: list[tuple[Wish, Answer]] = []
        while not self._wishes.answers.empty():
            wish, answer = self._wishes.answers.get()
            for name, readback in answer.readbacks.items():
                mirror.note_accepted(name, readback)
            self._note(wish, answer, now)
            if not wish.purpose:
                single.append((wish, answer))
        self._standing = mirror.standing()
        if mirror.scene is not None and self._unwritten and now >= self._write_at:
            self._unwritten, self._write_at = False, now + _WRITE_EVERY_S
            self._kept.write(mirror.scene, self.history, self.compare)
        return single

    def _note(self, wish: Wish, answer: Answer, now: float) -> None:
        if wish.purpose:
            self.words, self.alarm = answer.words, not answer.taken
        else:
            self.words = ""
        if not answer.taken:
            return
        self._unwritten = True
        after = {name: readback.value for name, readback in answer.readbacks.items()}
        if wish.purpose == UNDO:
            self.history.undone(wish.values)
        elif wish.purpose == REDO:
            self.history.redone(wish.values)
        else:
            self.history.note(wish.before, after, now)
        if wish.purpose in SLOTS:
            self.compare.switched(wish.purpose)
