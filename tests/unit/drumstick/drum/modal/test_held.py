"""A muffle on a bank of modes: what it covers; unpressed it changes no bit; however moved, it only takes."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.special import jv

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.muffle import MuffleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.engine import Engine, set_live
from drumstick.drum.memory.bank import PRESS_STEPS
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.modal.air_load import in_air
from drumstick.drum.modal.covered import covered_by
from drumstick.parameters.drum import Drum, Listen, Modal
from drumstick.parameters.scene import Scene
from mallets import joules, start_mallet, with_mallet
from realtime.records import is_there

RATE = 48_000
PATCHES = ((0.75, 0.0, 0.15),)
ASIDE = ((0.3, 0.5, 0.25), (0.45, 0.35, 0.3), (-0.8, -0.2, 0.2))  # two of them overlap
POLYESTER = TensionTable(young_GPa=5.2, thickness_mm=0.216, most_cents=1200.0)


def _plain(effects: dict[str, Any] | None = None, top_Hz: float = 3000.0, t60_s: float = 1.0) -> Scene:
    drum = Drum(f01_Hz=150.0, radius_m=0.17, t60_s=t60_s, effects=effects or {})
    return Scene("bank", drum=drum, modal=Modal(top_Hz))


def _under_tension(t60_s: float = 1.0, top_Hz: float = 6000.0) -> Scene:
    listen = Listen(microphones=((-0.5, 0.6, 0.5, -0.6),))
    return dataclasses.replace(
        with_mallet(_plain({"tension": POLYESTER, "air": AirTable(1.2, 0.26, "none")}, top_Hz, t60_s)),
        listen=listen,
    )


def _muffled(scene: Scene, press: float, t60_s: float = 0.02, patches: Any = PATCHES) -> Scene:
    effects = scene.drum.effects | {"muffle": MuffleTable(patches, t60_s, press)}
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects=effects))


def _struck(scene: Scene) -> Engine:
    ring = StrikeRing()
    engine = new_engine(scene, RATE, ring)
    ring.push(0, 0.3, 0.2, 5.0, 0.002, 0.0, 3.0)
    return engine


def _heard(engine: Engine, frames: int, block: int = 64) -> np.ndarray:
    out = np.zeros((frames, 2), np.float32)
    render_all(engine, out, block, 0)
    return out


def _press(engine: Engine) -> float:
    return float(engine.effects.muffle.state["press"][0])


@pytest.mark.parametrize("scene", [_plain(), _under_tension()], ids=["plain", "under tension"])
def test_a_patch_that_nobody_presses_changes_no_sample(scene: Scene) -> None:
    free, muffled = (_heard(_struck(each), RATE // 5) for each in (scene, _muffled(scene, 0.0)))
    assert np.abs(free).max() > 0.0
    np.testing.assert_array_equal(muffled, free)
    assert not np.array_equal(_heard(_struck(_muffled(scene, 1.0)), RATE // 5), free)


@pytest.mark.parametrize("scene", [_plain(), _under_tension()], ids=["plain", "under tension"])
def test_pairs_that_are_turned_sound_as_before(scene: Scene) -> None:
    """Patches beside the axis turn each pair: strikes, mallets, pickups and microphones are turned with it."""
    free, turned = (_heard(_struck(each), RATE // 5) for each in (scene, _muffled(scene, 0.0, patches=ASIDE)))
    assert not np.array_equal(turned, free)
    np.testing.assert_allclose(turned, free, atol=1e-4 * float(np.abs(free).max()))


@pytest.mark.parametrize("patches", [PATCHES, ASIDE])
def test_each_mode_is_damped_by_what_of_it_lies_under_the_patches(patches: Any) -> None:
    """Against a sum over a million places; pairs as the eigenvalues of what the patches do to the two together."""
    scene = _muffled(_plain(top_Hz=700.0), 1.0, patches=patches)
    found = covered_by(12.0, scene.drum)
    modes = in_air(12.0, scene.drum).modes
    assert found is not None
    side: np.ndarray = (np.arange(1500) + 0.5) / 750.0 - 1.0
    x, y = np.meshgrid(side, side)
    under = np.zeros(x.shape, bool)
    for at_x, at_y, radius in patches:
        under |= (x - at_x) ** 2 + (y - at_y) ** 2 <= radius**2
    r, phi = np.hypot(x, y)[under], np.arctan2(y, x)[under]
    inside, area, count = r <= 1.0, (side[1] - side[0]) ** 2, len(modes.orders)
    for p, (order, zero, norm) in enumerate(zip(*modes, strict=True)):
        radial = jv(order, zero * r) * inside
        pair = np.array([radial * np.cos(order * phi), radial * np.sin(order * phi)])
        own = np.array([found.shares[p], found.shares[count + p]])
        if order == 0:
            assert own[0] == pytest.approx(float(np.sum(pair[0] ** 2)) * area / norm, abs=1e-3)
            continue
        damping = pair @ pair.T * area / norm
        np.testing.assert_allclose(np.sort(own), np.linalg.eigvalsh(damping), atol=1e-3)
        cosine, sine = found.turn[:, p]
        turn = np.array([[cosine, sine], [-sine, cosine]])
        np.testing.assert_allclose(turn @ damping @ turn.T, np.diag(own), atol=1e-3)


def test_where_it_was_set_to_it_is_as_if_the_scene_had_said_so() -> None:
    """It goes there in twenty milliseconds while the drum rings; asleep, at once."""
    engines = moved, asleep, written = [_struck(_muffled(_under_tension(), p)) for p in (1.0, 1.0, 0.3)]
    _heard(moved, RATE // 20)
    assert _press(moved) == 1.0
    set_live(moved, "muffle", 0.3)
    _heard(moved, RATE // 100)
    assert 0.3 < _press(moved) < 1.0
    set_live(asleep, "muffle", 0.3)
    for engine in engines:
        _heard(engine, RATE // 4)
        assert _press(engine) == 0.3
    for name in ("r_squared", "stiffness", "masses", "tension_stiffness"):
        for engine in (moved, asleep):
            np.testing.assert_array_equal(getattr(engine.modal, name), getattr(written.modal, name))


def test_it_glides_alike_in_blocks_of_any_length() -> None:
    def heard(block: int) -> np.ndarray:
        engine = _struck(_muffled(_plain(), 0.0))
        first = _heard(engine, 4800, 64)
        set_live(engine, "muffle", 1.0)
        return np.concatenate([first, _heard(engine, 4800, block)])

    np.testing.assert_array_equal(heard(64), heard(480))
    np.testing.assert_array_equal(heard(64), heard(7))


def test_pressing_it_does_not_click() -> None:
    """On a drum with nothing above 600 Hz: above 2 kHz the change leaves 80 dB less than the sound."""

    def above(press: float) -> float:
        engine = _struck(_muffled(_plain(top_Hz=600.0), 0.0, 0.05, ((0.0, 0.0, 0.5),)))
        _heard(engine, 4800)
        set_live(engine, "muffle", press)
        power = np.abs(np.fft.rfft(_heard(engine, 9600)[:, 0].astype(float) * np.hanning(9600))) ** 2
        return float(10.0 * np.log10(power[400:].sum() / power.sum()))

    assert above(1.0) < -80.0
    assert above(1.0) - above(0.0) < 30.0


@pytest.mark.parametrize("t60_s", [0.001, 0.05])
def test_however_it_jumps_it_only_takes(t60_s: float) -> None:
    """The whole way within a step, as no set can make it, under mallets and a tension, without other losses."""
    scene = _muffled(_under_tension(math.inf, 3000.0), 0.0, t60_s, ASIDE)
    engine, chance = new_engine(scene, RATE, StrikeRing()), np.random.default_rng(5)
    engine.effects.muffle.state["most"] = 1.0
    step, worst, moves, touched = int(engine.control["divisor"][0]), 0.0, 0, 0
    # Steps from a stroke's begin to the next move: while the mallet comes, and when it has just left the head.
    for stroke, ahead in enumerate((5, 10, 70, 75, 80, 85, 90, 95)):
        until = (-int(engine.control["steps"][0]) - ahead) % PRESS_STEPS
        _heard(engine, until * step, step)
        start_mallet(engine, 3.0, 0.5 * math.cos(stroke), 0.5 * math.sin(stroke))
        before, whole, pressed = math.inf, 0.0, _press(engine)
        for n in range(800):
            if n % 100 == 0:
                set_live(engine, "muffle", float(chance.choice([0.0, 0.1, 1.0])))
            given_way = engine.mallets.tips["compliance"].copy()
            _heard(engine, step, step)
            now = joules(engine)
            whole = max(whole, now)
            worst = max(worst, (now - before) / whole)
            playing = bool((engine.mallets.pool["stage"] == 2).any())
            before = now if playing or n > 8 else math.inf
            moves += int(_press(engine) != pressed)
            if playing and _press(engine) != pressed:
                touched += 1
                assert (engine.mallets.tips["compliance"] != given_way).any()
            pressed = _press(engine)
    assert moves > 10
    assert touched > 0
    assert is_there(engine.effects.tension)
    assert worst < 4e-6
