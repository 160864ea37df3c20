"""The joint envelope: nothing non-finite, endless, too fast or too strong passes, and each refusal has words."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import envelope
from drumstick.safety.entry_speed import entry_speed
from drumstick.safety.envelope import Limits, judge, new_scratch, predicted, require
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import COLUMNS, simulate
from haptic_server.limits import limits_of
from haptic_server.servo.device.simulated import Simulated

ROLL = parse(shipped_text("roll"), "roll")
LIMITS = Limits(100.0, 10.0)
STICK_FIELDS = ("m", "k_coll", "r_in", "k_hand", "r_out", "z_ss")
PULSE_FIELDS = ("dv_pls", "tau")
# What the servo may find in a damaged block: any bits.
ANY = st.floats(allow_nan=True, allow_infinity=True) | st.sampled_from([0.0, -0.0, 5e-324, 1e308, -1e308])


def _law(values: dict[str, float], effects: bool = True) -> Records:
    law = law_of(ROLL if effects else Scene("bare"))
    for name, value in values.items():
        (law[0]["pulse"] if name in PULSE_FIELDS else law[0])[name] = value
    return law


def _judged(law: Records, limits: Limits = LIMITS) -> envelope.Judgement:
    return judge(law[0], limits.record()[0], new_scratch())


def _roll(**values: float) -> Records:
    return _law(values)


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_scenes_pass_their_own_guard(name: str) -> None:
    scene = parse(shipped_text(name), name)
    require(law_of(scene), limits_of(scene, Simulated(scene).info().specification))


REFUSED = {
    "no mass": (_roll(m=0.0), envelope.MASS, ["m = 0 kg", "above 0"]),
    "negative mass": (_roll(m=-1.0), envelope.MASS, ["m = -1 kg", "above 0"]),
    "mass is not a number": (_roll(m=math.nan), envelope.MASS, ["m = nan", "above 0"]),
    "no stiffness": (_roll(k_coll=0.0), envelope.NEGATIVE, ["k_coll", "above 0 N/m"]),
    "negative damping in contact": (_roll(r_in=-5.0), envelope.NEGATIVE, ["r_in", "must not be negative"]),
    "negative damping above": (_roll(r_out=-0.1), envelope.NEGATIVE, ["r_out", "must not be negative"]),
    "rest position is not a number": (
        _roll(z_ss=math.nan),
        envelope.NOT_FINITE,
        ["z_ss", "not a usable number"],
    ),
    "pulse is infinite": (_roll(dv_pls=math.inf), envelope.NOT_FINITE, ["dv_pls", "not a usable number"]),
    "pulse that grows": (_roll(tau=-0.002), envelope.NOT_FINITE, ["tau", "not a usable number"]),
    "pulse without duration": (_roll(tau=0.0), envelope.NOT_FINITE, ["tau", "not a usable number"]),
    "nothing damps": (_roll(r_in=0.0, r_out=0.0), envelope.ENDLESS, ["raise r_in", "lower dv_pls"]),
    "too fast": (_roll(dv_pls=5.0), envelope.SPEED, ["m/s", "limit is 10 m/s", "lower dv_pls"]),
    "too strong": (
        _roll(k_coll=1e6, r_in=20.0, dv_pls=1.0),
        envelope.FORCE,
        ["N", "limit is 100 N", "k_coll"],
    ),
    "a head that gives energy": (_roll(r_in=0.1, r_out=0.2), envelope.ACTIVE, ["r_in", "at least r_out"]),
    "a buzz": (_roll(m=1e-4, k_coll=1e6), envelope.BUZZ, ["less than 0.2 ms", "raise m"]),
    "a hand that throws": (
        _roll(k_hand=1e4, z_ss=0.5),
        envelope.HAND,
        ["hand alone", "limit is 10 m/s", "z_ss"],
    ),
    "thrown too hard": (
        _roll(k_coll=2e5, r_in=20.0, dv_pls=0.0),
        envelope.THROW,
        ["throw at 4 m/s", "limits are 10 m/s and 100 N", "throw in the scene"],
    ),
    "too sudden": (_roll(tau=1e-6), envelope.FORCE, ["N", "limit is 100 N", "raise tau"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_refusal_has_words(case: str) -> None:
    law, code, words = REFUSED[case]
    limits = dataclasses.replace(LIMITS, throw_m_per_s=4.0 if code == envelope.THROW else 0.0)
    assert _judged(law, limits).code == code
    with pytest.raises(Refusal) as refused:
        require(law, limits)
    for word in words:
        assert word in str(refused.value)


@pytest.mark.parametrize("case", REFUSED)
def test_a_refused_set_reaches_nothing_and_names_no_parameter_twice(case: str) -> None:
    law, code, _ = REFUSED[case]
    limits = dataclasses.replace(LIMITS, throw_m_per_s=4.0 if code == envelope.THROW else 0.0)
    assert _judged(law, limits) == (code, 0.0, 0)
    with pytest.raises(Refusal) as refused:
        require(law, limits)
    assert str(refused.value).count("k_hand") <= 1
    assert str(refused.value).count("k_coll") <= 1


@pytest.mark.parametrize("effects", [True, False])
@given(st.data())
def test_nothing_unusable_passes(effects: bool, data: st.DataObject) -> None:
    """Any bits in the record: OK means finite, in the allowed signs, and below both limits; else there are words."""
    names = STICK_FIELDS + (PULSE_FIELDS if effects else ())
    values = {name: data.draw(ANY, label=name) for name in names}
    law = _law(values, effects)
    code = _judged(law).code
    if code == envelope.OK:
        assert all(math.isfinite(value) for value in values.values())
        assert values["m"] > 0.0
        assert values["k_coll"] > 0.0
        assert values.get("tau", 1.0) > 0.0
        assert values.get("dv_pls", 0.0) >= 0.0
        assert min(values["r_in"], values["r_out"], values["k_hand"]) >= 0.0
        speed, force = predicted(law[0], 0.0)
        assert 0.0 <= speed <= LIMITS.max_speed_m_per_s
        assert 0.0 <= force <= LIMITS.max_force_N
        require(law, LIMITS)
    else:
        with pytest.raises(Refusal, match=r"\w+"):
            require(law, LIMITS)


@given(st.sampled_from(STICK_FIELDS + PULSE_FIELDS), st.sampled_from([math.nan, math.inf, -math.inf]))
def test_one_value_that_is_no_number_is_enough(name: str, value: float) -> None:
    assert _judged(_law({name: value}), Limits(math.inf, math.inf)).code != envelope.OK


@given(st.floats(0.0, 200.0, exclude_min=True), st.floats(0.0, 20.0, exclude_min=True))
def test_a_limit_that_is_not_a_number_lets_nothing_pass(force: float, speed: float) -> None:
    law = law_of(ROLL)
    assert _judged(law, Limits(math.nan, speed)).code != envelope.OK
    assert _judged(law, Limits(force, math.nan)).code != envelope.OK


@given(
    k_coll=st.floats(500.0, 2e4),
    zeta=st.floats(0.05, 0.9),
    dv=st.floats(0.0, 1.0),
    tau=st.floats(1e-4, 0.01),
    k_hand=st.floats(5.0, 200.0),
)
def test_what_is_predicted_bounds_what_is_played(
    k_coll: float, zeta: float, dv: float, tau: float, k_hand: float
) -> None:
    """The speeds of an `exit` roll stay below the prediction, which knows of no loss outside contact."""
    stick = Stick(0.015, k_coll, 2.0 * zeta * math.sqrt(0.015 * k_coll), k_hand, 0.1, -0.02, "paper")
    pulse = ROLL.effects["pulse"].__class__(dv, tau, "exit", 1)
    scene = stick_cases.scene(stick, pulse)
    speed, _ = predicted(law_of(scene)[0], 0.0)
    settled = simulate(scene, 3.0, 0.01).contacts
    v_e = settled[:, COLUMNS.index("v_e_m_per_s")]
    assert np.all(v_e <= max(speed, 0.01) * (1.0 + 1e-9))


@given(
    z=st.floats(0.0, 0.5),
    v=st.floats(-12.0, 12.0),
    left=st.floats(0.0, 5.0),
    k_hand=st.floats(0.0, 2000.0),
    z_ss=st.floats(-0.3, 0.1),
)
def test_a_set_that_may_take_over_now_brings_no_contact_beyond_the_limit(
    z: float, v: float, left: float, k_hand: float, z_ss: float
) -> None:
    """From any height and speed, with a pulse still running: the next contact, played exactly, is within bounds."""
    law, motion = _roll(k_hand=k_hand, z_ss=z_ss, tau=0.01), thrown(ROLL, 0.0)
    judged = _judged(law)
    if judged.code != envelope.OK or not entry_speed(law[0], z, v) + left <= judged.max_entry_speed:
        return
    motion["z"], motion["v"] = z, v
    motion["pulse"]["acceleration"] = left / 0.01
    gone = 0.0
    while gone < 2.0 and motion["outcome"][0] == exact.MOVING:
        event, moved = exact.advance(law[0], motion[0], 2.0 - gone)
        gone += moved
        if event == exact.ENTRY:
            assert abs(motion["v_in"][0]) <= LIMITS.max_speed_m_per_s * (1.0 + 1e-9)
            return


NO_NUMBERS = [(at, value) for at in ("z", "v", "left", "k_hand") for value in (math.nan, math.inf)]


@pytest.mark.parametrize(("at", "value"), NO_NUMBERS)
def test_no_set_takes_over_from_a_motion_that_is_no_number(at: str, value: float) -> None:
    given = {"z": 0.01, "v": 0.5, "left": 0.1, "k_hand": 20.0}

    def passes(z: float, v: float, left: float, k_hand: float) -> bool:
        return entry_speed(_roll(k_hand=k_hand)[0], z, v) + left <= _judged(_roll()).max_entry_speed

    assert passes(**given)
    assert not passes(**{**given, at: value})
