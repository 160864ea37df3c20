"""Gain, balance and mute that are set while a drum rings: they arrive, exactly, and nothing clicks on the way."""

import dataclasses
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build, full_scale
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output import levels
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse

RATE, BLOCK = 48_000, 64
# Nothing above 500 Hz: whatever is heard there, a change has made.
LOW = parse("[drum]\nf01_Hz = 150\nt60_s = 4\n[modal]\ntop_Hz = 450\n[listen]\ngain_dB = -12\n", "low")
ABOVE_Hz, WINDOW = 2_000.0, 8_192
Sound = npt.NDArray[np.float32]


def sound(
    scene: Scene, frames: int, change: Callable[[Engine, int], None] = lambda _engine, _at: None
) -> Sound:
    """One stroke; `change` is called before each block with its first frame."""
    ring = StrikeRing()
    engine = build(scene, RATE, ring)
    ring.push_blow(full_scale(scene))
    out = np.zeros((frames, 2), np.float32)
    for at in range(0, frames, BLOCK):
        change(engine, at)
        render_all(engine, out[at : at + BLOCK], BLOCK, 0)
    return out


def splatter_dB(heard: Sound) -> float:  # noqa: N802
    """Energy above 2 kHz in the window about the change, of that of the whole window, the louder side."""
    part = heard[WINDOW // 2 : WINDOW // 2 + WINDOW].astype(float) * np.blackman(WINDOW)[:, None]
    power = np.abs(np.fft.rfft(part, axis=0)) ** 2
    high = power[round(ABOVE_Hz * WINDOW / RATE) :].sum(axis=0)
    return float(10.0 * np.log10((high / power.sum(axis=0)).max()))


def at_the_middle(**changes: float) -> Callable[[Engine, int], None]:
    def change(engine: Engine, at: int) -> None:
        if at == WINDOW:
            for name, value in changes.items():
                set_live(engine, name.replace("_", "."), value)

    return change


CHANGES = {
    "mute": {"listen_mute": 1.0},
    "12 dB less": {"listen_gain": -24.0},
    "12 dB more": {"listen_gain": 0.0},
    "to the left": {"listen_pan": -0.9},
}


@pytest.mark.parametrize("name", CHANGES)
def test_no_change_clicks(name: str) -> None:
    """Above 2 kHz, where this drum has nothing: at most -70 dB of all, 40 dB less than a level that jumps."""
    change = at_the_middle(**CHANGES[name])

    def jump(engine: Engine, at: int) -> None:
        change(engine, at)
        target = engine.listening.target[0]
        levels.settle(engine.listening, target["listen_gain"], target["listen_pan"], target["listen_mute"])

    alone, ours, naive = (
        splatter_dB(sound(LOW, 2 * WINDOW, each)) for each in (lambda *_: None, change, jump)
    )
    print(f"alone {alone:.1f}, ours {ours:.1f}, naive {naive:.1f} dB")
    assert alone <= -90.0
    assert ours <= -70.0
    assert naive >= ours + 40.0


def test_a_fader_that_is_never_still_does_not_click() -> None:
    chance = np.random.default_rng(5)

    def shake(engine: Engine, _at: int) -> None:
        set_live(engine, "listen.gain", float(chance.uniform(-18.0, -6.0)))

    assert splatter_dB(sound(LOW, 2 * WINDOW, shake)) <= -70.0


@pytest.mark.parametrize(
    ("changes", "listen"),
    [
        ({"listen_mute": 1.0}, {"mute": 1.0}),
        ({"listen_gain": -3.0, "listen_pan": 0.25}, {"gain_dB": -3.0, "pan": 0.25}),
    ],
)
def test_what_is_set_ends_as_the_scene_that_says_so(
    changes: dict[str, float], listen: dict[str, float]
) -> None:
    """To the last bit, after 0.1 s."""
    said = dataclasses.replace(LOW, listen=dataclasses.replace(LOW.listen, **listen))
    frames = 2 * WINDOW
    arrived = WINDOW + RATE // 10
    live, own = sound(LOW, frames, at_the_middle(**changes)), sound(said, frames)
    assert np.array_equal(live[arrived:], own[arrived:])
    assert not np.array_equal(live[:WINDOW], own[:WINDOW])


def test_the_balance_takes_from_one_side_and_adds_to_none() -> None:
    middle, right = (
        sound(LOW, WINDOW),
        sound(dataclasses.replace(LOW, listen=dataclasses.replace(LOW.listen, pan=1.0)), WINDOW),
    )
    assert np.array_equal(right[:, 1], middle[:, 1])
    assert not right[:, 0].any()
