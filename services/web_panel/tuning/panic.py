"""PANIC, asked until it is confirmed: a gateway that just starts hears it when it is there.

`press` runs on viser's event loop, `seen` by the main thread.
"""

import asyncio
import time
from collections.abc import Callable

from web_panel.rig.answer import Answer

_ASKED_FOR_S = 60.0  # longer than another scene takes to start, unless its kernels are new to this machine


class Panic:
    """`ask` asks and waits, on a thread of its own. `line`: what to say of a press that nobody has confirmed."""

    def __init__(self, ask: Callable[[], Answer], asked_for_s: float = _ASKED_FOR_S) -> None:
        self._ask, self._asked_for_s = ask, asked_for_s
        self._pressed_at = float("-inf")
        self._until: float | None = None  # None: confirmed
        self.line = ""

    async def press(self, _: object = None) -> None:
        """Ask until somebody confirms it, or the time since the last press is over."""
        self._pressed_at = time.monotonic()
        self._until = self._pressed_at + self._asked_for_s
        while True:
            answer = await asyncio.to_thread(self._ask)
            until = None if answer.taken else self._until
            if until is None:  # by this answer, or by another press's while this one was asked
                self._confirmed()
                return
            if time.monotonic() >= until:
                self.line = (
                    f"PANIC was not confirmed within {self._asked_for_s:.0f} s, and is no longer asked. "
                    "Use the switch at the device; to ask again, press PANIC again."
                )
                return
            self.line = (
                f"PANIC was not confirmed: {answer.reason}. Use the switch at the device; it is asked again."
            )

    def seen(self, at: float) -> None:
        """The servo said at this time (monotonic) that a panic is latched: that confirms what was pressed before."""
        if at > self._pressed_at:
            self._confirmed()

    def _confirmed(self) -> None:
        self._until, self.line = None, ""
