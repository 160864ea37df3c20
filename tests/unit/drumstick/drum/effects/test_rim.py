"""The hoop: heard when the rim is struck, tuned, and silent for a stroke in the middle."""

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import PEAK_OF_FULL_SCALE, full_scale, strike_for_speed
from drumstick.drum.effects.rim import RATIOS, RimTable
from drumstick.drum.engine import Engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.drum import Modal
from drumstick.parameters.scene import Scene
from mallets import start_mallet, with_mallet
from realtime.records import is_there
from stability.mesh_steps import take

RATE = 48000


def sound(table: RimTable | None, x: float) -> npt.NDArray[np.float64]:
    scene = Scene("drum")
    effects = {} if table is None else {"rim": table}
    drum = dataclasses.replace(scene.drum, f01_Hz=300.0, t60_s=0.05, effects=effects)
    scene = dataclasses.replace(scene, drum=drum)
    blow = dataclasses.replace(full_scale(scene), x=x)
    return render(scene, [blow], 0.5, RATE)[:, 0].astype(float)


def test_the_middle_does_not_ring_the_hoop() -> None:
    assert np.array_equal(sound(RimTable(), 0.0), sound(None, 0.0))


def test_the_hoop_rings_at_its_modes() -> None:
    """After the head has died away, the lowest ones are left, at a ring's ratios."""
    rung = (sound(RimTable(f_Hz=600.0, t60_s=1.0), 1.0) - sound(None, 1.0))[2400:]
    spectrum = np.abs(np.fft.rfft(rung * np.hanning(len(rung))))
    step_Hz = RATE / len(rung)
    for ratio in RATIOS[:2]:
        at = round(600.0 * ratio / step_Hz)
        near = spectrum[at - 3 : at + 4]
        assert near.max() > 20.0 * np.median(spectrum[at - 60 : at + 60])
        assert abs(int(np.argmax(near)) - 3) <= 1


def test_its_level_is_what_the_scene_says() -> None:
    """A whole stroke on the rim, whose contact with the head is far longer than the hoop's."""
    one, half = (sound(RimTable(level=level), 1.0) - sound(None, 1.0) for level in (0.8, 0.4))
    assert np.abs(one).max() == pytest.approx(2.0 * np.abs(half).max(), rel=1e-3)
    assert 0.4 * 0.8 * PEAK_OF_FULL_SCALE < np.abs(one).max() < 1.1 * 0.8 * PEAK_OF_FULL_SCALE


WIDTH = 0.2


def struck(x: float, modal: Modal | None = None) -> Engine:
    """A drum with a hoop in the step after a mallet of 1 m/s has come down at x."""
    scene = Scene("drum", modal=modal)
    drum = dataclasses.replace(scene.drum, effects={"rim": RimTable(width=WIDTH)})
    engine = new_engine(with_mallet(dataclasses.replace(scene, drum=drum)), RATE, StrikeRing())
    start_mallet(engine, 1.0, x, 0.0)
    take(engine, 1)
    return engine


@pytest.mark.daily("0.3-0.0-None")
@pytest.mark.parametrize("modal", [None, Modal(3000.0)])
@pytest.mark.parametrize(("x", "share"), [(0.3, 0.0), (0.8, 0.0), (0.85, 0.25), (0.95, 0.75), (1.0, 1.0)])
def test_a_mallet_near_the_rim_meets_hoop_and_head_with_a_share_of_its_mass_each(
    x: float, share: float, modal: Modal | None
) -> None:
    """The hoop gets 2 share m v, in the first step only; what is left of the mass has m v^2/2 of its own."""
    engine = struck(x, modal)
    assert is_there(engine.effects.rim)
    assert engine.mallets is not None
    state, step_s = engine.mallets.state[0], float(engine.mallets.state["step_s"][0])
    mass_kg = step_s**2 / float(state["own_compliance"])
    assert float(engine.effects.rim.state["force"][0]) * step_s == pytest.approx(
        2.0 * share * mass_kg * 1.0, abs=1e-12
    )
    left_kg = step_s**2 / float(engine.mallets.pool["own_compliance"][0])
    assert left_kg == pytest.approx(max(1.0 - share, 1e-3) * mass_kg)
    take(engine, 1)
    assert float(engine.effects.rim.state["force"][0]) == 0.0


@pytest.mark.parametrize("modal", [None, Modal(3000.0)])
def test_a_mallet_on_the_rim_is_as_loud_as_the_scene_says(modal: Modal | None) -> None:
    scene = Scene("drum", modal=modal)
    drum = dataclasses.replace(scene.drum, f01_Hz=300.0, t60_s=0.05, effects={"rim": RimTable(level=0.8)})
    scene = with_mallet(dataclasses.replace(scene, drum=drum))
    blow = strike_for_speed(scene, scene.strike.full_scale_m_per_s, 1.0, 0.0)
    peak = float(np.abs(render(scene, [blow], 0.2, RATE)).max())
    assert 0.4 * 0.8 * PEAK_OF_FULL_SCALE < peak < 1.1 * 0.8 * PEAK_OF_FULL_SCALE
