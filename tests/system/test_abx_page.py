"""The blind test for ears, moved in a browser: what is played, what is counted, what is saved."""

import base64
import io
import math

import numpy as np
import pytest
import soundfile
from browser import visitor
from playwright.sync_api import Browser, Page, expect

from drumstick_lab.accuracy import whole
from drumstick_lab.benchmarks.recordings.abx import SECONDS, TRUEST, meshes, page, prepared
from drumstick_lab.benchmarks.recordings.beside_recordings import RATE_HZ

DRUMS: list[dict[str, object]] = [
    {"name": "snare", "strokes": [["data:recorded-1", "data:ours-1"], ["data:recorded-2", "data:ours-2"]]},
    {"name": "tom", "strokes": [["data:recorded-tom", "data:ours-tom"]]},
]
# Draws come from a list instead of from chance: stroke and X by turns.
DRAWN = """
const draws = [%s];
crypto.getRandomValues = into => { for (let i = 0; i < into.length; i++) into[i] = draws.shift() ?? 0; return into; };
window.played = [];
window.Audio = function (address) { window.played.push(address); return { play() {}, pause() {} }; };
"""


def _opened(browser: Browser, draws: str) -> Page:
    opened = visitor(browser).new_page()
    opened.set_content(page(DRUMS).replace('"use strict";', DRAWN % draws, 1))
    return opened


def test_what_x_plays_is_what_the_answer_is_judged_by(browser: Browser) -> None:
    opened = _opened(browser, "1, 1,  0, 0,  0, 1")
    try:
        for key in "abx":
            opened.keyboard.press(key)
        assert opened.evaluate("played") == ["data:recorded-2", "data:ours-2", "data:ours-2"]
        opened.get_by_role("button", name="X is A").click()
        expect(opened.locator("#said")).to_have_text("Wrong: X was ours, stroke 2.")
        opened.keyboard.press("x")
        assert opened.evaluate("played").pop() == "data:recorded-1"
        opened.keyboard.press("1")
        expect(opened.locator("#said")).to_have_text("Right: X was recorded, stroke 1.")
        expect(opened.locator("#count")).to_have_text(
            "1 of 2 right; guessing does as well with probability 0.750."
        )
        with opened.expect_download() as saved:
            opened.get_by_role("button", name="Save answers").click()
        assert saved.value.path().read_text() == "drum,stroke,x,said\nsnare,2,B,A\nsnare,1,A,A\n"
        opened.get_by_label("Drum").select_option("tom")
        opened.keyboard.press("a")
        assert opened.evaluate("played").pop() == "data:recorded-tom"
    finally:
        opened.context.close()


@pytest.mark.long
def test_meshes_stand_against_the_truest_equally_loud(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole, "TIERS", ("draft",))
    monkeypatch.setattr(whole, "REFERENCE_Hz", 16_000.0)
    [(name, both)] = meshes("accents")
    packed = [io.BytesIO(base64.b64decode(address.partition(",")[2])) for address in both]
    truest, draft = (soundfile.read(each)[0] for each in packed)
    assert name == "accents, draft"
    assert len(truest) == len(draft) == round(SECONDS * RATE_HZ)
    assert np.sqrt(np.mean(truest**2)) == pytest.approx(np.sqrt(np.mean(draft**2)), rel=1e-2)
    assert np.abs(truest - draft).max() > 0.1 * np.abs(truest).max()
    text = page([{"name": name, "strokes": [both]}], TRUEST)
    assert "A: truest mesh</button>" in text
    assert "ABX: the truest or not?" in text


@pytest.mark.parametrize("rate_Hz", [44_100.0, 48_000.0, 96_000.0])
def test_strokes_are_made_alike_before_they_are_compared(rate_Hz: float) -> None:
    t = np.arange(round(0.7 * rate_Hz)) / rate_Hz
    sound = np.exp(-8.0 * t) * np.sin(2.0 * math.pi * 200.0 * t)
    early, late = (
        np.concatenate([np.zeros(round(wait_s * rate_Hz)), level * sound])
        for wait_s, level in ((0.01, 1.0), (0.3, 0.2))
    )
    one, other = (prepared(np.stack([s, s], axis=1), rate_Hz) for s in (early, late))
    assert len(one) == round(SECONDS * RATE_HZ)
    assert np.sqrt(np.mean(one**2)) == pytest.approx(1.0)
    assert np.abs(one - other).max() < 0.02 * np.abs(one).max()
    spectrum = np.abs(np.fft.rfft(one))
    assert np.argmax(spectrum) / SECONDS == pytest.approx(200.0, abs=1.0)
