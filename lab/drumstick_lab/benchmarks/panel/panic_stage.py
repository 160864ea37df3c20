"""A rig that plays and its page, and what a hand or another client does to them: for panic-place."""

import contextlib
import os
import re
import signal
import subprocess
from collections.abc import Iterator
from typing import Any, NamedTuple

import zenoh
from browser import chromium, opened, page_at, part, slider
from playwright.sync_api import Page, expect
from rig_process import DRUMSTICK, Listener, Rig, ask, running, wait_for

from protocol.messages import State

PATIENCE_MS = 600_000.0  # a busy machine takes minutes over a scene; whoever waits, waits for an event
expect.set_options(timeout=PATIENCE_MS)


class Stage(NamedTuple):
    """A playing rig and a page of it; `kept` is what a state leaves for a later one to end."""

    rig: Rig
    session: zenoh.Session
    states: Listener[State]
    page: Page
    address: str
    kept: dict[str, Any]

    def press(self, name: str) -> None:
        """Press a button of the page."""
        self.page.get_by_role("button", name=name, exact=True).click()

    def key(self, slider_of: str, key: str) -> None:
        """Press a key on a slider."""
        slider(self.page, slider_of).focus()
        self.page.keyboard.press(key)

    def signal(self, module: str, number: signal.Signals) -> None:
        """Stop a service of the rig, or let it go on."""
        if number is not signal.SIGCONT:
            self.kept[module] = self.rig.children()[module]
        os.kill(self.kept[module], number)

    def arm(self) -> None:
        """Give the force back, as at the haptic machine."""
        subprocess.run([*DRUMSTICK, "arm", "--rig", self.rig.name], check=True, timeout=120)
        self.says("notice", "Playing|Ready")

    def set(self, **values: float) -> None:
        """Set values as another client of the wire does."""
        ask(self.session, self.rig.keys.set_many, values)

    def enter(self, parameter: str, value: str) -> None:
        """Type an exact value into the page."""
        opened(self.page, "More")
        self.press(parameter)
        self.page.get_by_role("textbox", name="Value", exact=True).fill(value)
        self.press("Set")

    def says(self, name: str, words: str) -> None:
        """Wait until a part of the page says this."""
        expect(part(self.page, name)).to_contain_text(re.compile(words))


@contextlib.contextmanager
def playing() -> Iterator[Stage]:
    """A rig that plays `roll`, and a page that shows it."""
    with running("up", "--scene", "roll") as rig, chromium() as browser:
        found = wait_for("the panel", lambda: re.search(r"panel: (http://\S+\?token=\S+)", rig.said), 300.0)
        session = rig.client(600.0)
        try:
            states = Listener(session, rig.keys.state, State)
            with page_at(browser, found[1], PATIENCE_MS) as page:
                yield Stage(rig, session, states, page, found[1], {})
        finally:
            session.close()  # type: ignore[no-untyped-call]
