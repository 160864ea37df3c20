"""States of a rig and of its page, one after the other, each made by what makes it on a stage: for panic-place."""

import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from browser import note, opened, part, readback, slider, visitor
from playwright.sync_api import expect
from rig_process import DRUMSTICK, wait_for

from drumstick_lab.benchmarks.panel.panic_stage import Stage
from protocol.messages import LeaseRequest, encode

VIEWS = ("Level", "Orbit", "Return map", "Spectrum", "Cost", "Accuracy", "Health", "Nothing", "Roll")


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
    # A stick that still bounces takes a value at once, and the next one.
    waiting = note(on.page, "k_coll").filter(has_text="waits until")

    def waits() -> bool:
        on.key("k_coll", "ArrowRight")
        on.page.wait_for_timeout(500)
        return waiting.count() > 0

    wait_for("a value that waits", waits, 120.0)


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
    # What the old panel showed says Playing until the new one's parts take its place.
    old = part(on.page, "notice").element_handle()
    on.signal("web_panel", signal.SIGKILL)
    on.page.bring_to_front()
    killed = on.kept["web_panel"]
    wait_for("another panel", lambda: on.rig.children().get("web_panel", 0) not in (0, killed), 120.0)
    on.page.wait_for_function("old => !old.isConnected", arg=old)
    expect(part(on.page, "notice")).to_contain_text("Playing")
    expect(part(on.page, "cut-off")).to_have_count(0)


class Step(NamedTuple):
    """A state: its words, how it is made, and where it is seen: selectors of a folder and of a part; none: at the top."""

    words: str
    make: Callable[[Stage], None]
    seen_at: tuple[str, ...] = ()


def _button(name: str) -> tuple[str, ...]:
    return (f'role=button[name="{name}"s]',)


def _part(name: str) -> tuple[str, ...]:
    return (f'[data-part="{name}"]',)


_MORE, _UNDO, _PRESETS, _LOCK, _SCENE = (
    _button(name) for name in ("More", "Undo", "Presets", "Lock tuning", "Scene")
)
_ROLL, _VIEWS, _STRIKE, _METER = (
    _button("Rate and level"),
    _button("Level"),
    _part("strike-pad"),
    _part("servo"),
)
_SERVO, _GATEWAY, _SOUND = "haptic_server.servo", "haptic_server.gateway", "sound_server"
STATES: tuple[Step, ...] = (
    Step("a value moved by key", _moved),
    Step("a change undone", _undone, _UNDO),
    Step("stored in A and in B", _stored, _UNDO),
    Step("switched from B to A", _switched, _UNDO),
    Step("a rate refused, with the nearest", _rate_refused, _ROLL),
    Step("a value refused by the envelope, the folder More open", _refused("dv_pls", "9"), _MORE),
    Step("a second value refused", _refused("k_coll", "1000000")),
    Step("an exact value that is no number", _no_number, _MORE + _part("exact")),
    Step("scrolled to the views", _scrolled_down, _VIEWS),
    *(Step(f"view: {name}", _view(name), _VIEWS) for name in VIEWS),
    Step("scrolled to the top", _scrolled_up),
    Step("the list of presets open", _opened("Presets"), _PRESETS),
    Step("a preset saved", _saved, _PRESETS),
    Step("a preset chosen", _chosen, _PRESETS),
    Step("a preset loaded", _loaded, _PRESETS),
    Step("a preset's name refused", _not_saved, _PRESETS),
    Step("the folder of the lock open", _opened("Lock tuning"), _LOCK),
    Step("locked to this page", _locked, _LOCK),
    Step("unlocked", _unlocked, _LOCK),
    Step("locked by somebody else", _locked_elsewhere),
    Step("the lock over", _lock_over),
    Step("the list of scenes open", _opened("Scene"), _SCENE),
    Step("a scene chosen", _scene_chosen, _SCENE),
    Step("through a change of scene, to snare", _changed("snare"), _SCENE),
    Step("through a change of scene, to tom", _changed("tom"), _SCENE),
    Step("through a change of scene, back", _changed("roll"), _SCENE),
    Step("the palette of commands open", _palette),
    Step("the palette closed", _palette_closed),
    Step("PANIC pointed at", _pointed_at),
    Step("PANIC focused", _focused),
    Step("a recording runs", _recorded),
    Step("the recording ended", _record_ended),
    Step("another browser changed a value", _second_browser),
    Step("a pointer's pad", _pointer),
    Step("no pad any more", _no_pointer),
    Step("a strike from the page", _struck, _STRIKE),
    Step("the stick at rest", _at_rest),
    Step("a value that waits", _waits),
    Step("panic", _panicked),
    Step("a scene refused in panic", _scene_refused, _SCENE),
    Step("armed again", Stage.arm),
    Step("another servo in the place of one that was killed", _servo_killed),
    Step("no sound server", _signalled(signal.SIGSTOP, _SOUND, "sound", "no sound server"), _METER),
    Step("the sound server again", _signalled(signal.SIGCONT, _SOUND, "sound", "played"), _METER),
    Step("no data from the haptic server", _signalled(signal.SIGSTOP, _GATEWAY, "notice", "No data")),
    Step("PANIC pressed while nobody answers", _not_confirmed),
    Step("the haptic server again, in panic", _signalled(signal.SIGCONT, _GATEWAY, "notice", "Panic")),
    Step("armed after that panic", Stage.arm),
    Step("the panel hangs", _cut_off),
    Step("the panel goes on", _connected),
    Step("another panel in its place", _panel_killed),
)
