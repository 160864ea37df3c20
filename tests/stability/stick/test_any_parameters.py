"""Every set that the tables' ranges allow, with and without effects: no NaN, no endless loop, what never changes."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

import stick_cases
from any_scene import COMBINATIONS, PULSES, STICKS, eased, likely_scenes, scenes
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import bounds, envelope
from drumstick.stick import composition
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from drumstick.stick.simulate import COLUMNS, simulate
from realtime.kernels.jit import njit
from stability.catalogue import shows
from stability.stick_play import MAX_EVENTS, play_on

# How long to play: some time constants of the hand, not longer, or a light stick makes millions of contacts.
DURATION_S = 0.2
SPEEDS = st.floats(-10.0, 10.0)
EVERY_COMBINATION = pytest.mark.parametrize("names", COMBINATIONS.values(), ids=COMBINATIONS)
V_E = COLUMNS.index("v_e_m_per_s")


def _any(names: tuple[str, ...]) -> st.SearchStrategy[Scene]:
    return scenes(names) | likely_scenes(names)


@shows("any numbers of the tables", "ours")
@given(data=st.data(), v0=SPEEDS)
def test_nothing_becomes_nan_and_every_event_moves_on(data: st.DataObject, v0: float) -> None:
    play_on(data.draw(_any(COMBINATIONS["all"])), v0, DURATION_S)


@shows("any numbers of the tables", "ours")
@pytest.mark.long
@EVERY_COMBINATION
@settings(max_examples=150)
@given(data=st.data(), v0=SPEEDS)
def test_nor_with_any_combination_of_effects(names: tuple[str, ...], data: st.DataObject, v0: float) -> None:
    play_on(data.draw(_any(names)), v0, DURATION_S)


@pytest.mark.parametrize(
    ("stick", "pulse", "v0"),
    [
        (Stick(1e-4, 1e6, 1e3, 1e4, 1e3, -1.0, "paper"), Pulse(10.0, 1e-6, "exit", 1), 10.0),
        (Stick(1e-4, 1e6, 0.0, 1e4, 1e3, 1.0, "unilateral"), Pulse(10.0, 1.0, "entry", -1), -10.0),
        (Stick(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, "unilateral"), None, 0.0),
    ],
)
def test_the_corners_of_the_table(stick: Stick, pulse: Pulse | None, v0: float) -> None:
    play_on(stick_cases.scene(stick, pulse), v0, DURATION_S)


def _energy(stick: Stick, z: float, v: float, in_head: bool) -> float:
    # Divided by m. In the head its spring counts, also while the stick is loose: it is still compressed then.
    spring = stick.k_coll_N_per_m * z * z if in_head else 0.0
    hand = stick.k_hand_N_per_m * (z - stick.z_ss_m) ** 2
    return 0.5 * v * v + 0.5 * (spring + hand) / stick.m_kg


# Each effect at the value with which it does nothing.
NEUTRAL: dict[str, dict[str, float]] = {
    "hysteretic_spring": {"ratio": 1.0},
    "negative_damping": {"r_N_s_per_m": 0.0},
    "noise": {"force_N": 0.0},
    "chaos": {"force_N": 0.0},
    "pulse": {"dv_m_per_s": 0.0},
    "cor_pulse": {"gamma": 0.0},
}


def _neutral(scene: Scene) -> Scene:
    effects = {name: dataclasses.replace(table, **NEUTRAL[name]) for name, table in scene.effects.items()}
    return dataclasses.replace(scene, effects=effects)


@shows("any numbers of the tables", "ours")
@pytest.mark.parametrize("combination", ["none", "pulse", "cor_pulse", "head"])
@settings(max_examples=150)
@given(data=st.data(), v0=SPEEDS)
@pytest.mark.daily("head")
def test_without_an_effect_that_adds_it_energy_never_grows(
    combination: str, data: st.DataObject, v0: float
) -> None:
    scene = _neutral(data.draw(_any(COMBINATIONS[combination])))
    stick = scene.stick
    # Below R_out the head's own damper is negative: it does give energy.
    assume(stick.release == "paper" or stick.r_in_N_s_per_m >= stick.r_out_N_s_per_m)
    law, motion, t = law_of(scene), thrown(scene, v0), 0.0
    before = start = _energy(stick, 0.0, v0, in_head=False)
    for _ in range(MAX_EVENTS):
        event, moved = exact.advance(law[0], motion[0], DURATION_S - t)
        t += moved
        z, v = float(motion["z"][0]), float(motion["v"][0])
        now = _energy(stick, z, v, in_head=z < 0.0)
        assert now <= before * (1.0 + 1e-9) + start * 1e-12
        before = now
        if event == exact.HORIZON or motion["outcome"][0] != exact.MOVING or t >= DURATION_S:
            return


@settings(max_examples=100)
@given(STICKS, PULSES, SPEEDS)
def test_a_run_ends_and_its_rows_are_in_order(stick: Stick, pulse: Pulse, v0: float) -> None:
    duration_s = 200.0 * math.sqrt(stick.m_kg / stick.k_coll_N_per_m)
    run = simulate(Scene("any", stick=stick, effects={"pulse": pulse}), duration_s, v0)
    assert np.all(np.isfinite(run.contacts))
    assert np.all(run.contacts[:, 0] <= run.contacts[:, 2])
    # t_in is t_out less the contact time: the last digit may be lost.
    assert np.all(run.contacts[1:, 0] >= run.contacts[:-1, 2] - 1e-15 * duration_s)
    assert run.t_end_s <= duration_s * (1.0 + 1e-12)


def accepted(law: Records) -> bool:
    """True when the envelope lets it pass on the exact stick, with limits that few sets come near."""
    limits = envelope.Limits(100.0, 10.0).record()
    return envelope.judge(law[0], limits[0], envelope.new_scratch()).code == envelope.OK


MANY_ARE_REFUSED = [HealthCheck.filter_too_much, HealthCheck.too_slow]
A_THROW = {"data": st.data(), "share": st.floats(1e-3, 1.0), "inside": st.booleans()}


@settings(max_examples=15, suppress_health_check=MANY_ARE_REFUSED)
@given(**A_THROW)
def test_no_contact_exceeds_what_the_envelope_predicts(
    data: st.DataObject, share: float, inside: bool
) -> None:
    """The speeds at entry and exit, and the head's force, of every set that the envelope lets pass."""
    _stays_below_what_is_predicted(data.draw(likely_scenes(COMBINATIONS["all"])), share, inside)


@pytest.mark.long
@EVERY_COMBINATION
@settings(max_examples=60, suppress_health_check=MANY_ARE_REFUSED)
@given(**A_THROW)
def test_nor_does_one_with_any_combination_of_effects(
    names: tuple[str, ...], data: st.DataObject, share: float, inside: bool
) -> None:
    _stays_below_what_is_predicted(data.draw(likely_scenes(names)), share, inside)


def _stays_below_what_is_predicted(scene: Scene, share: float, inside: bool) -> None:
    law = law_of(scene)
    for _ in range(8):  # few combinations of strong effects are allowed
        if accepted(law):
            break
        scene = eased(scene)
        law = law_of(scene)
    assume(accepted(law))
    blows = bounds.bounds_of_contact(law[0])
    max_roll_speed = bounds.max_roll_speed(law[0], blows)
    max_roll_speed = max(
        max_roll_speed, 1e-3
    )  # a stick that nothing drives: some blow that the performer makes
    max_contact_force = bounds.max_contact_force(law[0], blows, max_roll_speed)
    hand = bounds.hand_speed(law[0])
    down = inside and bounds.max_restitution(law[0]) < 1.0 and scene.stick.z_ss_m <= 0.0
    motion, t = thrown(scene, (-share if down else share) * max_roll_speed), 0.0
    contact_s = math.pi * math.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    for _ in range(600):
        event, moved = exact.advance(law[0], motion[0], 0.09 * contact_s)
        t += moved
        if event == exact.ENTRY:
            assert -motion["v_in"][0] <= max_roll_speed * (1.0 + 1e-9) + 1e-9 * hand
        if event == exact.RELEASE:
            assert motion["v_out"][0] <= max_roll_speed * (1.0 + 1e-9) + 1e-9 * hand
        if motion["contact_phase"][0] != exact.ABOVE or event == exact.RELEASE:
            assert motion["peak_N"][0] <= max_contact_force * (1.0 + 1e-9)
        if motion["outcome"][0] != exact.MOVING:
            return


def _events(scene: Scene, v0: float, tick_s: float | None = None) -> list[tuple[int, float, float, float]]:
    contact_s = math.pi * math.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    return stick_cases.events(law_of(scene), thrown(scene, v0), 20.0 * contact_s, tick_s)[:30]


def _sensitive(
    scene: Scene, v0: float, whole: list[tuple[int, float, float, float]]
) -> list[list[float]] | None:
    # By how much each event's instant, place and speed move when a number is off by 1e-13: what rounding may do, where
    # a contact grazes or a small speed is the rest of a large one. None when other events come: nobody can say which.
    moved = [[0.0, 0.0, 0.0] for _ in whole]
    others = [_events(scene, v0 * (1.0 + 1e-13))]
    for key in ("m_kg", "k_coll_N_per_m", "r_in_N_s_per_m", "k_hand_N_per_m", "z_ss_m"):
        off = dataclasses.replace(scene.stick, **{key: getattr(scene.stick, key) * (1.0 - 1e-13)})
        others.append(_events(dataclasses.replace(scene, stick=off), v0))
    for other in others:
        if [event for event, *_ in other] != [event for event, *_ in whole]:
            return None
        for most, (_, *found), (_, *wanted) in zip(moved, other, whole, strict=True):
            most[:] = [max(m, abs(f - w)) for m, f, w in zip(most, found, wanted, strict=True)]
    return moved


def _same_when_split(scene: Scene, v0: float, ratio: float) -> bool:
    # False when rounding decides what happens.
    contact_s = math.pi * math.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    whole = _events(scene, v0)
    rounding = _sensitive(scene, v0, whole)
    if rounding is None:
        return False
    ticks = _events(scene, v0, ratio * contact_s)
    # A tick may notice sooner that the stick has come to rest: before the last turn in the head.
    assert len(whole) - 1 <= len(ticks) <= len(whole)
    assert [event for event, *_ in ticks] == [event for event, *_ in whole[: len(ticks)]]
    # A late force is fed back, and multiplies what rounding did to the instant of a sample.
    near = 1e-7 if "system_delay" in scene.effects else 1e-9
    max_roll_speed = max([v0] + [abs(v) for *_, v in whole])
    # As many roundings as ticks, each worth a few of those.
    often = 10.0 * (1.0 + 20.0 / ratio)
    for (_, t, z, v), (_, t_whole, z_whole, v_whole), (dt, dz, dv) in zip(
        ticks, whole, rounding, strict=False
    ):
        assert abs(t - t_whole) <= near * (contact_s + t_whole) + often * dt
        assert abs(z - z_whole) <= near * contact_s * max_roll_speed + often * dz
        assert abs(v - v_whole) <= near * max_roll_speed + often * dv
    return True


@EVERY_COMBINATION
@settings(max_examples=60, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(data=st.data(), v0=st.floats(0.01, 5.0), ratio=st.floats(0.02, 0.9))
@pytest.mark.daily("all")
def test_events_do_not_depend_on_how_the_run_is_split(
    names: tuple[str, ...], data: st.DataObject, v0: float, ratio: float
) -> None:
    assume(_same_when_split(data.draw(likely_scenes(names)), v0, ratio))


def test_a_hand_that_presses_with_two_kilonewtons_split_into_a_thousand_ticks() -> None:
    """Found by chance: 0.5 m/s where the stick enters and leaves, 83 m/s within the head, no losses."""
    stick = Stick(math.exp(-4.0), 29420.876068369507, 0.0, 1e4, 0.0, -0.22313016014842982, "paper")
    assert _same_when_split(stick_cases.scene(stick), 0.5, 0.021484375)


FORCES = ("m_kg", "k_coll_N_per_m", "r_in_N_s_per_m", "k_hand_N_per_m", "r_out_N_s_per_m")


def _times(table: Any, factor: float, keys: tuple[str, ...]) -> Any:
    return dataclasses.replace(table, **{key: factor * getattr(table, key) for key in keys})


@pytest.mark.long
@pytest.mark.parametrize("combination", ["none", "pulse", "head"])
@settings(max_examples=60)
@given(data=st.data(), v0=st.floats(0.01, 5.0))
def test_mass_and_every_force_scaled_together_change_nothing(
    combination: str, data: st.DataObject, v0: float
) -> None:
    """Twice the mass with twice the springs, dampers and forces is the same motion, to the last bit."""
    scene = data.draw(likely_scenes(COMBINATIONS[combination]))
    assume(
        2.0 * max(scene.stick.m_kg, scene.stick.k_coll_N_per_m / 1e6, scene.stick.k_hand_N_per_m / 1e4) <= 1.0
    )
    effects = dict(scene.effects)
    for name, keys in (
        ("noise", ("force_N",)),
        ("chaos", ("force_N",)),
        ("negative_damping", ("r_N_s_per_m",)),
    ):
        if name in effects:
            effects[name] = _times(effects[name], 2.0, keys)
    doubled = dataclasses.replace(scene, stick=_times(scene.stick, 2.0, FORCES), effects=effects)
    duration_s = 20.0 * math.pi * math.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    once, twice = (stick_cases.events(law_of(s), thrown(s, v0), duration_s) for s in (scene, doubled))
    assert once == twice


@settings(max_examples=100)
@given(
    zeta=st.floats(0.0, 0.9),
    factor=st.floats(1e-2, 1e2),
    release=st.sampled_from(["paper", "unilateral"]),
    m=st.floats(0.01, 0.1),
)
@example(zeta=0.0, factor=100.0, release="paper", m=0.01)
def test_beta_depends_on_the_product_of_mass_and_stiffness_only(
    zeta: float, factor: float, release: Any, m: float
) -> None:
    """m c with K_coll / c leaves (3) as it is, and so does the played contact; it takes c times as long."""
    stick = Stick(m, 5000.0, 2.0 * zeta * math.sqrt(m * 5000.0), 0.0, 0.0, 0.0, release)
    other = dataclasses.replace(stick, m_kg=m * factor, k_coll_N_per_m=5000.0 / factor)
    found = [stick_cases.until(stick_cases.scene(s), -1.0, exact.RELEASE, 1e3) for s in (stick, other)]
    assert found[0] is not None
    assert found[1] is not None
    (one, t_one), (two, t_two) = found
    assert two["v_out"][0] == pytest.approx(one["v_out"][0], rel=1e-10)
    assert t_two == pytest.approx(factor * t_one, rel=1e-10)


@pytest.mark.parametrize("combination", ["none", "pulse"])
@settings(max_examples=60)
@given(data=st.data(), v0=st.floats(0.01, 5.0), power=st.integers(-3, 3))
def test_speed_scales_without_a_scale_of_its_own(
    combination: str, data: st.DataObject, v0: float, power: int
) -> None:
    """The equations are linear: lengths and speeds (z_ss, dv too) times 2^n give the same events at the same times.

    Not to the last bit: a push that has died away to nothing is left out, and then another form of the solution serves.
    """
    scene = data.draw(likely_scenes(COMBINATIONS[combination]))
    factor = 2.0**power
    effects = {name: _times(table, factor, ("dv_m_per_s",)) for name, table in scene.effects.items()}
    scaled = dataclasses.replace(scene, stick=_times(scene.stick, factor, ("z_ss_m",)), effects=effects)
    duration_s = 20.0 * math.pi * math.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    once, other = (
        stick_cases.events(law_of(s), thrown(s, v), duration_s)
        for s, v in ((scene, v0), (scaled, factor * v0))
    )
    assert [event for event, *_ in once] == [event for event, *_ in other]
    assert [t for _, t, *_ in once] == pytest.approx([t for _, t, *_ in other], rel=1e-9)
    for column in (2, 3):
        ours, theirs = (np.array([row[column] for row in rows]) for rows in (once, other))
        assert factor * ours == pytest.approx(theirs, rel=1e-9, abs=1e-9 * np.abs(theirs).max(initial=0.0))


@njit()
def _remaining(law: Law, motion: Motion) -> float:
    return composition.most_remaining_speed(law, motion)


def test_the_rows_name_what_the_envelope_bounds() -> None:
    """v_E of every contact of the shipped roll, and the bound that refuses sets, tell of the same speed."""
    scene = stick_cases.scene(stick_cases.STICK_A, Pulse(0.2, 0.002, "exit", 1))
    law = law_of(scene)
    speed, _ = envelope.predicted(law[0], 0.0)
    v_e = simulate(scene, 5.0).contacts[:, V_E]
    assert 0.5 * speed < v_e[-1] < speed
    assert _remaining(law[0], thrown(scene, 0.4)[0]) == 0.0
