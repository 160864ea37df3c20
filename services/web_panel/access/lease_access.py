"""The writer's lease, held for one browser: taken, renewed while that browser is there, given back when it is not.

Its claim goes with that browser's requests alone, so the haptic server refuses every other one: also those of other
browsers at this panel. A thread of its own asks; all methods but `_run` return at once, any thread.
"""

import queue
import secrets
import threading
from collections.abc import Callable
from typing import NamedTuple

from web_panel.rig.answer import Answer

LEASE_S = 5.0
_RENEW_S = 1.5


class _Holder(NamedTuple):
    client: int
    name: str
    secret: str


class LeaseAccess:
    """`ask(secret, name, seconds)` asks the haptic server and waits for the answer."""

    def __init__(self, ask: Callable[[str, str, float], Answer], renew_s: float = _RENEW_S) -> None:
        self._ask = ask
        self._renew_s = renew_s
        self._holder: _Holder | None = None
        self._returned: list[_Holder] = []
        self._changed = threading.Condition()
        self._stirred = self._ended = False
        self.outcomes: queue.SimpleQueue[tuple[str, bool]] = (
            queue.SimpleQueue()
        )  # words, and whether they alarm
        self._thread = threading.Thread(target=self._run, name="lease", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def close(self) -> None:
        """Give back what is held, and end."""
        with self._changed:
            self._let_go()
            self._ended = self._stirred = True
            self._changed.notify()
        self._thread.join()

    @property
    def name(self) -> str:
        """Holder of the lease at this panel; "" nobody."""
        holder = self._holder
        return holder.name if holder is not None else ""

    def secret_of(self, client: int | None) -> str:
        """The claim that goes with this browser's requests; "" when it does not hold the lease."""
        holder = self._holder
        return holder.secret if holder is not None and holder.client == client else ""

    def take(self, client: int, name: str) -> None:
        """This browser wants to tune alone."""
        with self._changed:
            if self._holder is not None and self._holder.client != client:
                self.outcomes.put((f"Refused: locked by {self._holder.name}: ask them to unlock it", True))
                return
            secret = self._holder.secret if self._holder is not None else secrets.token_hex(16)
            self._holder = _Holder(client, name, secret)
            self._stir()

    def give_back(self, client: int) -> None:
        """This browser has finished, or is gone."""
        with self._changed:
            if self._holder is not None and self._holder.client == client:
                self._let_go()
                self._stir()

    def _let_go(self) -> None:
        if self._holder is not None:
            self._returned.append(self._holder)
            self._holder = None

    def _stir(self) -> None:
        self._stirred = True
        self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(
                    lambda: self._stirred, self._renew_s if self._holder is not None else None
                )
                ended, self._stirred = self._ended, False
                returned, self._returned = self._returned, []
                holder = self._holder
            for former in returned:
                self._ask(former.secret, former.name, 0.0)
            if ended:
                return
            if holder is not None:
                self._renew(holder)

    def _renew(self, holder: _Holder) -> None:
        answer = self._ask(holder.secret, holder.name, LEASE_S)
        self.outcomes.put((answer.words, not answer.taken))
        if answer.refused:
            with self._changed:
                if self._holder == holder:
                    self._holder = None
