"""States of a rig and of its page, one after the other, each made by what makes it on a stage: for panic-place."""

import contextlib
import os
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import zenoh
from browser import chromium, note, opened, page_at, part, readback, slider, visitor
from playwright.sync_api import Page, expect
from rig_process import DRUMSTICK, Listener, Rig, ask, running, wait_for

from protocol.messages import LeaseRequest, State, encode

PATIENCE_MS = 600_000.0  # a busy machine takes minutes over a scene; whoever waits, waits for an event
expect.set_options(timeout=PATIENCE_MS)
VIEWS = ("Level", "Orbit", "Return map", "Spectrum", "Cost", "Accuracy", "Health", "Nothing", "Roll")


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


def _moved(on: Stage) -> None:
    on.key("dv_pls", "ArrowRight")
    expect(readback(on.page, "dv_pls")).to_have_text("0.205m/s")


def _undone(on: Stage) -> None:
    on.press("Undo")
    expect(readback(on.page, "dv_pls")).to_have_text("0.2m/s")


def _stored(on: Stage) -> None:
    on.press("Store in A")
    on.press("Store in B")
    on.says("sets", "B is on")


def _switched(on: Stage) -> None:
    on.press("A")
    on.says("sets", "A is on")


def _rate_refused(on: Stage) -> None:
    on.key("rate", "End")
    on.says("roll", "nearest")


def _refused(name: str, value: str) -> Callable[[Stage], None]:
    def act(on: Stage) -> None:
        on.enter(name, value)
        expect(note(on.page, name)).to_contain_text("Refused")

    return act


def _no_number(on: Stage) -> None:
    on.enter("k_coll", "nan")
    on.says("exact", "not a finite number")


def _scrolled_down(on: Stage) -> None:
    part(on.page, "view").first.scroll_into_view_if_needed()


def _scrolled_up(on: Stage) -> None:
    part(on.page, "notice").scroll_into_view_if_needed()


def _opened(folder: str) -> Callable[[Stage], None]:
    return lambda on: opened(on.page, folder)


def _saved(on: Stage) -> None:
    opened(on.page, "Presets")
    on.page.get_by_role("textbox", name="Name", exact=True).fill("loud")
    on.press("Save preset")
    on.says("preset", "loud: saved")


def _not_saved(on: Stage) -> None:
    opened(on.page, "Presets")
    on.page.get_by_role("textbox", name="Name", exact=True).fill("/")
    on.press("Save preset")
    on.says("preset", "Refused")


def _chosen(on: Stage) -> None:
    opened(on.page, "Presets")
    on.press("loud")
    on.says("preset", "loud: chosen")


def _loaded(on: Stage) -> None:
    opened(on.page, "Presets")
    on.press("Load preset")
    on.says("preset", "loud: loaded")


def _locked(on: Stage) -> None:
    opened(on.page, "Lock tuning")
    on.press("Lock to me")
    on.says("lease", "Locked by technician")


def _unlocked(on: Stage) -> None:
    opened(on.page, "Lock tuning")
    on.press("Unlock")
    expect(part(on.page, "lease")).to_have_count(0)


def _locked_elsewhere(on: Stage) -> None:
    request = LeaseRequest(who="a secret", name="Ada, at the mixing desk of the hall", seconds=5.0)
    reply = next(iter(on.session.get(on.rig.keys.lease, payload=encode(request), timeout=60.0)))
    assert reply.ok is not None
    on.says("lease", "Locked by Ada")


def _lock_over(on: Stage) -> None:
    expect(part(on.page, "lease")).to_have_count(0)


def _scene_chosen(on: Stage) -> None:
    opened(on.page, "Scene")
    on.press("snare")
    on.says("scene-answer", "snare: chosen")


def _changed(name: str) -> Callable[[Stage], None]:
    def act(on: Stage) -> None:
        opened(on.page, "Scene")
        on.press(name)
        on.says("scene-answer", f"{name}: chosen")
        on.press("Play this scene")
        on.says("scene", f"Scene: {name}")
        on.says("notice", "Playing|Ready")

    return act


def _view(name: str) -> Callable[[Stage], None]:
    def act(on: Stage) -> None:
        on.press(name)
        if name == "Nothing":
            expect(part(on.page, "view")).to_have_count(0)
        else:
            expect(part(on.page, "view").filter(has_text=re.compile(f"^{name}$"))).to_have_count(1)

    return act


def _palette(on: Stage) -> None:
    on.page.keyboard.press("Control+k")
    expect(on.page.get_by_placeholder("Search commands...")).to_be_focused()


def _palette_closed(on: Stage) -> None:
    on.page.mouse.click(5, 5)  # beside it, as whoever does not want a PANIC has to
    expect(on.page.get_by_placeholder("Search commands...")).to_have_count(0)


def _pointed_at(on: Stage) -> None:
    on.page.get_by_role("button", name="PANIC").hover()
    expect(on.page.locator("button:hover")).to_contain_text("PANIC")


def _focused(on: Stage) -> None:
    on.page.mouse.move(0, 0)
    on.page.get_by_role("button", name="PANIC").focus()


def _recorded(on: Stage) -> None:
    path = Path(on.kept["folder"]) / "panic-place.mcap"
    command = [*DRUMSTICK, "record", "--rig", on.rig.name, "--connect", on.rig.endpoint, "--out", str(path)]
    on.kept["recorder"] = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    wait_for("the recording", path.exists, 120.0)


def _record_ended(on: Stage) -> None:
    on.kept["recorder"].send_signal(signal.SIGINT)
    on.kept["recorder"].wait(120.0)


def _second_browser(on: Stage) -> None:
    browser = on.page.context.browser
    assert browser is not None
    other = visitor(browser, (560, 900))
    page = other.new_page()
    page.goto(on.address)
    expect(readback(page, "dv_pls")).to_contain_text("m/s")
    slider(page, "dv_pls").press("ArrowRight")
    expect(readback(on.page, "dv_pls")).to_have_text("0.205m/s")
    other.close()


def _pointer(on: Stage) -> None:
    key = on.rig.keys.alive("pointer", f"{on.states.got[-1].boot:x}")
    on.kept["pointer"] = on.session.liveliness().declare_token(key)
    expect(part(on.page, "pad")).to_have_count(1)


def _no_pointer(on: Stage) -> None:
    on.kept["pointer"].undeclare()
    expect(part(on.page, "pad")).to_have_count(0)


def _struck(on: Stage) -> None:
    part(on.page, "strike-pad").focus()
    on.page.keyboard.press("Space")
    on.says("strike", "Played|Strike")


def _at_rest(on: Stage) -> None:
    on.set(dv_pls=0.0)
    expect(part(on.page, "roll-rate")).to_contain_text(re.compile(r"^Roll rate(0\.0|–)"))


def _waits(on: Stage) -> None:
    on.key("k_coll", "ArrowRight")
    expect(note(on.page, "k_coll")).to_contain_text("waits until")


def _panicked(on: Stage) -> None:
    on.page.get_by_role("button", name="PANIC").click()
    on.says("notice", "Panic: zero force")


def _scene_refused(on: Stage) -> None:
    opened(on.page, "Scene")
    on.press("tom")
    on.says("scene-answer", "tom: chosen")
    on.press("Play this scene")
    on.says("scene-answer", "drumstick arm")


def _servo_killed(on: Stage) -> None:
    on.signal(_SERVO, signal.SIGKILL)
    wait_for("another servo", lambda: on.rig.children().get(_SERVO, 0) not in (0, on.kept[_SERVO]), 120.0)
    on.says("notice", "Playing")


def _signalled(number: signal.Signals, module: str, name: str, words: str) -> Callable[[Stage], None]:
    def act(on: Stage) -> None:
        on.signal(module, number)
        on.says(name, words)

    return act


def _not_confirmed(on: Stage) -> None:
    on.page.get_by_role("button", name="PANIC").click()
    on.says("panic", "not confirmed")


def _cut_off(on: Stage) -> None:
    on.signal("web_panel", signal.SIGSTOP)
    on.says("cut-off", "No connection")


def _connected(on: Stage) -> None:
    on.signal("web_panel", signal.SIGCONT)
    on.page.bring_to_front()  # viser connects again only while the window has the focus
    expect(part(on.page, "cut-off")).to_have_count(0)


def _panel_killed(on: Stage) -> None:
    on.signal("web_panel", signal.SIGKILL)
    on.page.bring_to_front()
    wait_for("another panel", lambda: on.rig.children().get("web_panel") != on.kept["web_panel"], 120.0)
    expect(part(on.page, "notice")).to_contain_text("Playing")
    expect(part(on.page, "cut-off")).to_have_count(0)


_SERVO, _GATEWAY, _SOUND = "haptic_server.servo", "haptic_server.gateway", "sound_server"
STATES: tuple[tuple[str, Callable[[Stage], None]], ...] = (
    ("a value moved by key", _moved),
    ("a change undone", _undone),
    ("stored in A and in B", _stored),
    ("switched from B to A", _switched),
    ("a rate refused, with the nearest", _rate_refused),
    ("a value refused by the envelope, the folder More open", _refused("dv_pls", "9")),
    ("a second value refused", _refused("k_coll", "1000000")),
    ("an exact value that is no number", _no_number),
    ("scrolled to the views", _scrolled_down),
    *((f"view: {name}", _view(name)) for name in VIEWS),
    ("scrolled to the top", _scrolled_up),
    ("the list of presets open", _opened("Presets")),
    ("a preset saved", _saved),
    ("a preset chosen", _chosen),
    ("a preset loaded", _loaded),
    ("a preset's name refused", _not_saved),
    ("the folder of the lock open", _opened("Lock tuning")),
    ("locked to this page", _locked),
    ("unlocked", _unlocked),
    ("locked by somebody else", _locked_elsewhere),
    ("the lock over", _lock_over),
    ("the list of scenes open", _opened("Scene")),
    ("a scene chosen", _scene_chosen),
    ("through a change of scene, to snare", _changed("snare")),
    ("through a change of scene, to tom", _changed("tom")),
    ("through a change of scene, back", _changed("roll")),
    ("the palette of commands open", _palette),
    ("the palette closed", _palette_closed),
    ("PANIC pointed at", _pointed_at),
    ("PANIC focused", _focused),
    ("a recording runs", _recorded),
    ("the recording ended", _record_ended),
    ("another browser changed a value", _second_browser),
    ("a pointer's pad", _pointer),
    ("no pad any more", _no_pointer),
    ("a strike from the page", _struck),
    ("the stick at rest", _at_rest),
    ("a value that waits", _waits),
    ("panic", _panicked),
    ("a scene refused in panic", _scene_refused),
    ("armed again", Stage.arm),
    ("another servo in the place of one that was killed", _servo_killed),
    ("no sound server", _signalled(signal.SIGSTOP, _SOUND, "sound", "no sound server")),
    ("the sound server again", _signalled(signal.SIGCONT, _SOUND, "sound", "played")),
    ("no data from the haptic server", _signalled(signal.SIGSTOP, _GATEWAY, "notice", "No data")),
    ("PANIC pressed while nobody answers", _not_confirmed),
    ("the haptic server again, in panic", _signalled(signal.SIGCONT, _GATEWAY, "notice", "Panic")),
    ("armed after that panic", Stage.arm),
    ("the panel hangs", _cut_off),
    ("the panel goes on", _connected),
    ("another panel in its place", _panel_killed),
)
