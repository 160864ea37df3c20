"""An arm that is not what the set says, a throw no set should make, a driver that lets go, and a very long account."""

import dataclasses

import numpy as np
import pytest

import live_sets
import sampled_arm
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from drumstick.stick.simulate import COLUMNS, simulate
from haptic_server.records import NO_FAULT, SELF_DRIVEN, TOO_FAST
from haptic_server.servo import loop
from haptic_server.servo.force import guard
from stability.catalogue import shows

T, ARM_KG, LIMIT_N, COUNT_M = 1e-3, 0.075, 8.5, 3e-5
PEAK = COLUMNS.index("peak_force_N")


@shows("throw outside the guard")
def test_numbers_that_are_each_in_range_throw_beyond_the_limit_of_force() -> None:
    """1 kg at 5 m/s on 1e6 N/m: the sound and the page would be told of thousands of newtons."""
    played = parse(
        f"{shipped_text('roll')}\n[guard]\nmax_force_N = 100.0\n[hand]\nthrow_m_per_s = 5.0\n", "thrown"
    )
    stick = dataclasses.replace(played.stick, m_kg=1.0, k_coll_N_per_m=1e6, r_in_N_s_per_m=200.0)
    scene = dataclasses.replace(played, stick=stick, effects={})
    naive = simulate(scene, 1.0, -5.0).contacts
    assert naive[0, PEAK] > 40.0 * 100.0
    with pytest.raises(Refusal, match=r"throw at 5 m/s .* N, the limits are"):
        envelope.require(law_of(scene), envelope.Limits.of(scene))


@shows("arm mass other than the scene's")
def test_a_pulse_for_a_stick_heavier_than_the_arm_throws_it_too_fast() -> None:
    """A pulse is m dv: with a set of 1 kg in front of 75 g, each is thirteen times as fast as it says."""
    scene = sampled_arm.scene("hold")
    naive = sampled_arm.servo_of(scene)
    naive.law["m"] = 1.0
    loop.run_virtual(naive, 4000, 0)
    assert naive.tick_state["fault"][0] == TOO_FAST

    servo = sampled_arm.servo_of(scene)
    wanted = live_sets.changed(law_of(scene), scene, {"m": 1.0})
    assert not live_sets.gateway_takes(law_of(scene), scene, {"m": 1.0})
    live_sets.offer(servo, 1, wanted)
    loop.run_virtual(servo, 4000, 0)
    assert servo.tick_state["refused_revision"][0] == 1
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert np.max(np.abs(servo.trace["force_N"])) > 0.3  # and it plays on


def _blow(lets_go: bool, speed: float = 1.2) -> tuple[float, float]:
    # The plain head of 3500 N/m under a driver that clamps a force above its limit, or lets go: the depth, and the
    # speed after 30 ms.
    z, v, deepest = 0.0, -speed, 0.0
    for _ in range(300):
        force = max(-3500.0 * z, 0.0)
        if force > LIMIT_N:
            force = 0.0 if lets_go else LIMIT_N
        v += 1e-4 * force / ARM_KG
        z += 1e-4 * v
        deepest = min(deepest, z)
    return deepest, v


@shows("driver that lets go above its limit")
def test_a_force_that_vanishes_above_a_limit_lets_the_arm_through_the_head() -> None:
    """Some drivers send nothing in place of too much: the deeper the arm is, the surer it meets no head."""
    assert _blow(lets_go=False)[1] > 0.0
    through, still_down = _blow(lets_go=True)
    assert still_down < -0.5
    assert through < -0.02

    servo = sampled_arm.servo_of(sampled_arm.scene("hold"))
    now = loop.run_virtual(servo, 1000, 0)
    servo.plant["z_m"], servo.plant["v_m_per_s"] = 0.004, -1.2
    servo.track["known"] = 0
    sent, deepest = list[float](), 0.0
    for _ in range(100):
        now = loop.run_virtual(servo, 1, now)
        sent.append(float(servo.tick_state["force_N"][0]))
        deepest = min(deepest, float(servo.plant["z_m"][0]))
    assert max(sent) == pytest.approx(LIMIT_N)  # such a blow does ask for all that the motors have
    assert all(abs(force) <= LIMIT_N for force in sent)
    assert deepest > -0.02
    assert float(servo.plant["z_m"][0]) > 0.0


class _Contacts:
    """An arm that meets its head again as fast as it left it, at another phase of the tick each time.

    The account is a contact's own, as the servo has it, or the classical one, which is never begun anew, or none. The
    device is a tick late, and says so.
    """

    def __init__(self, account: str, speed: float) -> None:
        self.account, self.speed = account, speed
        self.state, self.limits = np.zeros(1, guard.GUARD), np.zeros(1, guard.DEVICE_LIMITS)
        self.state["gain"], self.state["seen_above"], self.state["max_restitution"] = 1.0, 1, 0.9
        for name, value in {
            "max_force_N": LIMIT_N, "max_slew_N_per_s": 1e9, "max_speed_m_per_s": 1.5, "lowest_m": -0.1,
            "highest_m": 0.3, "ramp_s": 0.3, "resolution_m": COUNT_M, "m_kg": ARM_KG, "delay_ticks": 1,
        }.items():  # fmt: skip
            self.limits[name] = value
        self.chance = np.random.default_rng(3)
        self.begun = 0

    def _force(self, asked: float, z: float, v: float) -> float:
        if self.account == "none":
            return min(max(asked, 0.0), LIMIT_N)
        return float(guard.limit(self.state[0], self.limits[0], asked, 0.0, z, v, T))

    def blow(self, k: float, r: float) -> float:
        """One contact with a head of k N/m and r N s/m; the speed after it, m/s."""
        v = -self.speed
        z = v * T * self.chance.uniform()
        total = float(self.state["given_J"][0])
        self.begun += 1
        guard.begin_contact(self.state[0], self.limits[0], ARM_KG, v, self.begun * 10**9)
        if self.account == "classical":
            self.state["given_J"], self.state["budget_J"] = total, 0.0
        self.state["z_m"], late = z, 0.0
        for _ in range(300):
            coming = self._force(max(-k * z - r * v, 0.0), z, v)
            z, v, late = z + v * T + 0.5 * late / ARM_KG * T * T, v + late / ARM_KG * T, coming
            if z > 0.0 and late == 0.0:
                break
        for _ in range(4):  # on its way: the last forces are seen to have acted
            self._force(0.0, z, v)
            z += v * T
        return v


@shows("account of thousands of contacts")
@pytest.mark.parametrize("k", [1000.0, 1500.0])
def test_what_a_head_took_in_a_thousand_contacts_is_no_credit_for_the_next(k: float) -> None:
    """A classical observer saves what damped contacts took. A head that then gives too much spends all of it."""
    fastest: dict[str, float] = {}
    for account in ("none", "classical", "ours"):
        arm, speeds = _Contacts(account, 0.3), list[float]()
        for _ in range(1000):  # a hand that strikes again at 0.3 m/s
            assert arm.blow(k, 3.0) < 0.3 * 1.05 or account == "none"
        for _ in range(1000):  # and a head without a damper of its own, late by a tick: it rolls by itself
            arm.speed = arm.blow(k, 0.0)
            speeds.append(arm.speed)
            if not 0.01 < arm.speed < 2.0:
                break
        fastest[account] = max(speeds)
    assert fastest["none"] > 2.0
    assert fastest["classical"] > 2.0
    assert fastest["ours"] < 0.3


@shows("account of thousands of contacts", "ours")
def test_a_debt_is_carried_over_thousands_of_contacts_and_becomes_a_fault() -> None:
    """A microjoule too much at each of five thousand contacts: no single one would be noticed."""
    arm = _Contacts("ours", 0.5)
    codes = list[int]()
    for number in range(5000):
        codes.append(guard.begin_contact(arm.state[0], arm.limits[0], ARM_KG, -0.5, number * 10**9))
        assert arm.state["given_J"][0] == pytest.approx(1e-6 * number, rel=1e-11)
        arm.state["given_J"] += 1e-6
    # From where the debt is the energy of 5 cm/s, and for more than a dozen contacts.
    assert codes.index(SELF_DRIVEN) == pytest.approx(0.5 * ARM_KG * 0.05**2 / 1e-6 + 13, abs=2)
    assert set(codes[codes.index(SELF_DRIVEN) :]) == {SELF_DRIVEN}
