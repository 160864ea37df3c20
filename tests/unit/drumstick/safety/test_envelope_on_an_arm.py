"""The envelope on a sampled arm: where each of its rules begins, by hand, and what its words and numbers say."""

import dataclasses
import math
import re

import pytest

from drumstick.parameters.scene import Scene
from drumstick.safety import bounds, envelope, sampled_contact
from drumstick.safety.envelope import Limits, judge, new_scratch, require
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import Records, law_of

T, COUNT_M = 1e-3, 3e-5
ARM = Limits(8.5, 1.5, 0.0, 3500.0, T, 0, T / 2.0, 0.064, 0.15, 500.0, COUNT_M)
JUST = 1e-3


def _law(k: float, r: float, scene: Scene | None = None, r_out: float = 0.1, m: float = 0.075) -> Records:
    law = law_of(scene or Scene("bare"))
    law["m"], law["k_coll"], law["r_in"] = m, k, r
    law["k_hand"], law["r_out"], law["z_ss"] = 60.0, r_out, -0.01
    return law


def _judged(law: Records, limits: Limits = ARM) -> envelope.Judgement:
    return judge(law[0], limits.record()[0], new_scratch())


def _refusal(law: Records, limits: Limits = ARM) -> str:
    with pytest.raises(Refusal) as refused:
        require(law, limits)
    return str(refused.value)


def test_an_ordinary_set_is_taken_with_the_longest_window() -> None:
    assert _judged(_law(400.0, 4.0)) == (
        envelope.OK,
        pytest.approx(0.65 * 1.5),
        sampled_contact.MAX_WINDOW,
    )


def test_stiffer_than_the_device() -> None:
    soft = dataclasses.replace(ARM, stiffness_N_per_m=1000.0)
    assert _judged(_law(1000.0, 4.0), soft).code == envelope.OK
    assert _judged(_law(1000.0 * (1.0 + JUST), 4.0), soft).code == envelope.STIFF
    assert "1000 N/m" in _refusal(_law(1001.0, 4.0), soft)


@pytest.mark.parametrize(("delay", "lag"), [(0, 0.5), (1, 1.5), (3, 3.5)])
def test_a_damping_that_the_lag_eats_up(delay: int, lag: float) -> None:
    """R_in above K times the mean age of the force, whatever else."""
    late = dataclasses.replace(ARM, delay_ticks=delay, lead_s=lag * T)
    least = 200.0 * lag * T
    assert _judged(_law(200.0, least * (1.0 - JUST), r_out=0.01), late).code == envelope.LATE
    assert _judged(_law(200.0, least * (1.0 + JUST), r_out=0.01), late).code != envelope.LATE
    assert f"{lag:g} ms late on average" in _refusal(_law(200.0, 0.5 * least, r_out=0.01), late)


def test_longer_delays_than_are_judged() -> None:
    for delay, late in ((8, False), (9, True)):
        limits = dataclasses.replace(ARM, delay_ticks=delay)
        assert (_judged(_law(50.0, 2.0), limits).code == envelope.LATE) == late
    # More damping would not help, so it is not advised.
    assert re.search(
        r"comes 9 ticks late, more than the 8 .*: lower the delay", _refusal(_law(50.0, 2.0), limits)
    )


@pytest.mark.parametrize(("period_s", "ticks"), [(0.0010, 1), (0.0011, 2), (0.0031, 4)])
def test_a_head_that_is_sampled_itself_comes_whole_ticks_later(period_s: float, ticks: int) -> None:
    scene = parse(f"[effects.system_delay]\nperiod_s = {period_s}\ndelay_ticks = 0\n", "late head")
    found = [
        _judged(_law(100.0, 4.0, of), limits)
        for of, limits in ((scene, ARM), (None, dataclasses.replace(ARM, delay_ticks=ticks)))
    ]
    assert found[0].code == found[1].code == envelope.OK
    assert found[0].window == found[1].window
    assert f"{0.5 + ticks:g} ms late on average" in _refusal(_law(1000.0, 0.1, scene, r_out=0.01), ARM)


@pytest.mark.parametrize(("delay", "kick"), [(0, 0.46e-3), (2, 0.46e-3 / 1.12), (4, 0.46e-3 / 1.24)])
def test_a_damper_that_answers_each_count_with_a_jerk(delay: int, kick: float) -> None:
    """(R_in - R_out + K lead) q/(n m) of the lightest arm, with the longest window that is stable."""
    heavy = dataclasses.replace(ARM, lightest_kg=0.3, heaviest_kg=0.31, period_s=T / 2.0, lead_s=T / 4.0)
    heavy = dataclasses.replace(heavy, delay_ticks=delay)
    k, window = 1000.0, sampled_contact.MAX_WINDOW
    most = kick * window * 0.3 / COUNT_M - k * T / 4.0 + 0.1
    assert _judged(_law(k, most * (1.0 - JUST)), heavy).code == envelope.OK
    refused = _law(k, most * (1.0 + JUST))
    assert _judged(refused, heavy).code == envelope.COUNT_LIMIT_CYCLE
    words = _refusal(refused, heavy)
    assert f"a limit cycle of encoder counts of {COUNT_M * 1e3:g} mm" in words
    assert "0.3 .. 0.31 kg" in words
    offered = re.search(r"lower r_in to ([\d.]+) N s/m", words)
    assert offered is not None
    assert float(offered[1]) == pytest.approx(most, rel=0.02)
    assert float(offered[1]) < most


def test_a_slow_blow_that_grows_by_counts() -> None:
    """Every rule but that of the slow blow takes this set: a light damper far from any limit, eight ticks late."""
    limits = dataclasses.replace(ARM, delay_ticks=8, lead_s=0.0, period_s=5e-4, max_speed_m_per_s=10.0)
    limits = dataclasses.replace(limits, lightest_kg=0.1048, heaviest_kg=0.148, grip_N_per_m=6.6)
    law = _law(819.2319, 5.6467, r_out=0.13456)
    assert _judged(law, limits).code == envelope.COUNT_LIMIT_CYCLE
    assert _judged(law, dataclasses.replace(limits, resolution_m=COUNT_M / 30.0)).code == envelope.OK


def test_an_arm_that_swings_by_counts_on_a_stiff_spring() -> None:
    """sqrt(K/m) q of the lightest arm; the words name the stiffness that is taken."""
    light = dataclasses.replace(ARM, lightest_kg=0.03, heaviest_kg=0.042, period_s=2.5e-4, lead_s=1.25e-4)
    most = 0.03 * (sampled_contact.MAX_OSCILLATION_M_PER_S / COUNT_M) ** 2
    assert _judged(_law(most * (1.0 - JUST), 5.0, m=0.04), light).code == envelope.OK
    refused = _law(most * (1.0 + JUST), 5.0, m=0.04)
    assert _judged(refused, light).code == envelope.COUNT_OSCILLATION
    words = _refusal(refused, light)
    assert f"lower k_coll to {most:.4g} N/m" in words
    assert "0.03 .. 0.042 kg" in words
    assert "0.03 mm" in words


def test_a_head_that_drives_an_arm_by_itself() -> None:
    refused = _law(3500.0, 75.0)
    late = dataclasses.replace(ARM, delay_ticks=1, lead_s=1.5 * T)
    assert _judged(refused, late).code == envelope.SELF_DRIVEN
    assert "rendered 1.5 ms late" in _refusal(refused, late)
    assert "no r_in will do: lower k_coll" in _refusal(refused, late)


def test_one_parameter_at_a_time_the_offered_damping_is_the_nearest_that_is_taken() -> None:
    for law in (_law(1000.0, 0.6), _law(1000.0, 40.0)):
        words = _refusal(law)
        offered = re.search(r"(lower|raise) r_in to ([\d.]+) N s/m", words)
        assert offered is not None
        value = float(offered[2])
        assert (offered[1] == "lower") == (value < float(law["r_in"][0]))
        law["r_in"] = value
        assert _judged(law).code == envelope.OK
        law["r_in"] = value * (1.05 if offered[1] == "lower" else 0.95)
        assert _judged(law).code != envelope.OK


def test_a_pulse_takes_of_the_speed_that_an_arm_may_come_with() -> None:
    scene = parse(shipped_text("phantom"), "phantom")
    law = law_of(scene)
    without, given = law.copy(), float(law["pulse"]["dv_pls"][0])
    without["pulse"]["dv_pls"] = 0.0
    assert given > 0.0
    faster, slower = _judged(without), _judged(law)
    assert faster.max_entry_speed == pytest.approx(0.65 * 1.5)
    assert slower.max_entry_speed == pytest.approx(faster.max_entry_speed - given)


def test_the_exact_stick_has_a_window_that_means_nothing_and_the_reach_of_its_forces() -> None:
    exact = dataclasses.replace(ARM, period_s=0.0)
    judged = _judged(_law(1000.0, 4.0), exact)
    assert judged.window == sampled_contact.MAX_WINDOW
    blows = bounds.bounds_of_contact(_law(1000.0, 4.0)[0])
    most = bounds.max_contact_force(_law(1000.0, 4.0)[0], blows, judged.max_entry_speed)
    assert most == pytest.approx(8.5, rel=1e-3)
    assert math.isfinite(judged.max_entry_speed)
