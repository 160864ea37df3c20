"""The shipped drums beside real ones that others measured; reference/README.md says what does not agree."""

import dataclasses
import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.special import jn_zeros

from drumstick.drum.effects.cavity import spring
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.air_load import in_air, zero_at
from drumstick.drum.modal.building import decay_rates
from drumstick.parameters.drum import Modal
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from mallets import touched_s
from membranes import coupled_modes
from published import DRUMS

Numbers = npt.NDArray[np.float64]
Modes = list[tuple[int, int]]


def shipped(name: str) -> Scene:
    return parse(shipped_text(name), name)


def over_11(name: str, modes: Modes) -> Numbers:
    """f of a shipped drum's modes over that of its (1,1)."""
    drum = shipped(name).drum
    found = in_air(zero_at(6.0 * drum.f01_Hz, drum), drum)
    f_Hz = [found.f_Hz[found.modes.orders == m][n - 1] for m, n in [(1, 1), *modes]]
    return np.array(f_Hz[1:]) / f_Hz[0]


def in_vacuum(modes: Modes) -> Numbers:
    """The same of an ideal head."""
    return np.array([jn_zeros(m, n)[-1] for m, n in modes]) / jn_zeros(1, 1)[0]


@pytest.mark.parametrize("name", ["timpani", "low-timpani"])
def test_the_timpani_have_a_real_ones_ratios(name: str) -> None:
    modes = [(m, n) for m, n in DRUMS["timpano"]["modes"]]
    assert over_11(name, modes) == pytest.approx(DRUMS["timpano"]["ratios"], rel=0.01)


@pytest.mark.parametrize("name", ["timpani", "low-timpani"])
def test_the_timpanis_lowest_mode_is_a_thump_and_their_pitch_rings(name: str) -> None:
    """With all losses of the scene: (0,1) is gone in 0.4 s, (2,1) rings five times as long at least. No table of decay
    times of real ones was found (README.md)."""
    drum = shipped(name).drum
    found = in_air(zero_at(6.0 * drum.f01_Hz, drum), drum)
    t60_s = 3.0 * math.log(10.0) / (found.decays + decay_rates(drum, found.f_Hz))
    thump_s, _, second_s = (t60_s[found.modes.orders == m][0] for m in range(3))
    assert thump_s < 0.4
    assert second_s > 5.0 * thump_s


@pytest.mark.parametrize("name", ["high-tom", "mid-tom", "low-tom"])
def test_the_toms_have_a_real_ones_ratios_above_their_lowest_mode(name: str) -> None:
    real = {(m, n): r for (m, n), r in zip(DRUMS["tom"]["modes"], DRUMS["tom"]["ratios"], strict=True)}
    modes = [(2, 1), (0, 2), (3, 1), (4, 1)]
    ratios = np.array([real[mode] for mode in modes]) / real[1, 1]
    assert over_11(name, modes) == pytest.approx(ratios, rel=0.06)
    assert (np.abs(in_vacuum(modes) / ratios - 1.0) > 0.08).all()


def test_the_bass_drum_has_an_orchestras_ratios() -> None:
    """Over the higher of the pair (1,1). The modes above it have nothing to do with the other head."""
    real = DRUMS["bass_drum"]
    modes = [(m, n) for m, n in real["modes"][4:]]
    ratios = np.array(real["f_Hz"][4:]) / real["f_Hz"][3]
    assert over_11("bass-drum", modes) == pytest.approx(ratios, rel=0.08)
    assert (np.abs(in_vacuum(modes) / ratios - 1.0) > 0.08).all()


def two_heads(name: str) -> list[float]:
    """The lowest two modes of a shipped drum's coupled heads, Hz: exact, of ideal heads."""
    drum = shipped(name).drum
    table = drum.effects["cavity"]
    return coupled_modes((drum.f01_Hz, table.f01_Hz), spring(table, 1.0), 600.0)[:2]


def by_masses(name: str, of_each_head: int = 1) -> Numbers:
    """The same by the model of two masses: each head has its lowest mode only, and the air is a spring between. Or by
    one of more masses: each head has so many of its modes (0,n), of which the air feels the mean, 2/j_0n."""
    drum = shipped(name).drum
    table = drum.effects["cavity"]
    stiffness = 1.2 * 343.0**2 / (table.head_kg_per_m2 * table.depth_m)  # rho c^2 over sigma and depth
    zeros = jn_zeros(0, of_each_head)
    alone = 2.0 * np.pi / J01 * np.concatenate([drum.f01_Hz * zeros, table.f01_Hz * zeros])
    mean = np.concatenate([2.0 / zeros, -2.0 / zeros])
    squares = np.linalg.eigvalsh(np.diag(alone**2) + stiffness * np.outer(mean, mean))
    return np.sqrt(squares[:2]) / (2.0 * np.pi)


def test_the_snares_two_heads_part_the_lowest_mode_as_a_real_ones_do() -> None:
    low_Hz, high_Hz = two_heads("snare")
    real_low_Hz, real_high_Hz = DRUMS["snare"]["f_Hz"][:2]
    assert high_Hz / low_Hz == pytest.approx(real_high_Hz / real_low_Hz, rel=0.08)
    two_low_Hz, two_high_Hz = by_masses("snare")
    assert low_Hz == pytest.approx(two_low_Hz, rel=0.01)
    assert high_Hz == pytest.approx(two_high_Hz, rel=0.12)  # higher modes yield too
    assert [low_Hz, high_Hz] == pytest.approx(by_masses("snare", 2), rel=0.01)


def test_the_toms_two_heads_part_the_lowest_mode_as_masses_with_a_spring_between_do() -> None:
    """The lower one as two masses do. The higher one of two would lie at 282 Hz, above the upper head's (0,2) alone
    (252 Hz), which they do not have: that mode is pressed down to 230 Hz, as four masses say."""
    low_Hz, high_Hz = two_heads("tom")
    two_low_Hz, two_high_Hz = by_masses("tom")
    assert low_Hz == pytest.approx(two_low_Hz, rel=0.01)
    upper_02_Hz = shipped("tom").drum.f01_Hz * jn_zeros(0, 2)[1] / J01
    assert high_Hz < upper_02_Hz < two_high_Hz
    assert [low_Hz, high_Hz] == pytest.approx(by_masses("tom", 2), rel=0.01)


def test_a_stick_stays_on_the_high_tom_as_long_as_on_a_real_one() -> None:
    scene = dataclasses.replace(shipped("high-tom"), modal=Modal(4000.0))
    full = scene.strike.full_scale_m_per_s
    at_centre = [touched_s(scene, share * full, 0.0) for share in (0.1, 1.0)]
    assert at_centre == pytest.approx(DRUMS["contact"]["dahl_s"], rel=0.1)
    assert touched_s(scene, full, 0.9) == pytest.approx(DRUMS["contact"]["wagner_hard_at_rim_s"], rel=0.12)
