"""The guard's account of energy, against the exact work on a mass and over thousands of contacts."""

import numpy as np
import pytest

from haptic_server.records import SELF_DRIVEN
from haptic_server.servo.force import guard
from stability.catalogue import shows

T, ARM_KG, LIMIT_N, COUNT_M = 1e-3, 0.075, 8.5, 3e-5
BOUNDLESS_J = 1e3


class _Contacts:
    """An arm that meets its head again as fast as it left it, at another phase of the tick each time.

    The account is a contact's own, as the servo has it, or the classical one, which is never begun anew, or none. The
    device is `delay` ticks late, and says so; it reads whole counts. `work_J` is the head's work in the last contact,
    `naive_J` what an account finds that lets small moves wait and gives them the newest force.
    """

    def __init__(self, account: str, speed: float, restitution: float = 0.9, delay: int = 1) -> None:
        self.account, self.speed, self.delay = account, speed, delay
        self.state, self.limits = np.zeros(1, guard.GUARD), np.zeros(1, guard.DEVICE_LIMITS)
        self.state["gain"], self.state["seen_above"], self.state["max_restitution"] = 1.0, 1, restitution
        for name, value in {
            "max_force_N": LIMIT_N, "max_slew_N_per_s": 1e9, "max_speed_m_per_s": 1.5, "lowest_m": -0.1,
            "highest_m": 0.3, "ramp_s": 0.3, "resolution_m": COUNT_M, "m_kg": ARM_KG, "delay_ticks": delay,
        }.items():  # fmt: skip
            self.limits[name] = value
        self.chance = np.random.default_rng(3)
        self.begun = 0
        self.work_J = self.naive_J = 0.0

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
        elif self.account == "boundless":
            self.state["given_J"], self.state["budget_J"] = 0.0, BOUNDLESS_J
        counted = _read(z)
        self.state["z_m"] = self.state["counted_m"] = counted
        self.work_J = self.naive_J = acts = 0.0
        coming = [0.0] * self.delay
        for _ in range(300):
            seen = _read(z)
            if abs(seen - counted) > 1.5 * COUNT_M:
                self.naive_J += acts * (seen - counted)
                counted = seen
            coming.append(self._force(max(-k * seen - r * v, 0.0), seen, v))
            acts = coming.pop(0)
            way = v * T + 0.5 * acts / ARM_KG * T * T
            self.work_J += acts * way
            z, v = z + way, v + acts / ARM_KG * T
            if z > 0.0 and v > 0.0 and acts == 0.0 and not any(coming):
                break
        for _ in range(self.delay + 3):  # the last forces are seen to have acted
            self._force(0.0, _read(z), v)
            z += v * T
        return v


def _read(z: float) -> float:
    return float(np.floor(z / COUNT_M)) * COUNT_M


@shows("slow blow that turns between two counts")
@pytest.mark.parametrize("delay", [1, 2])
@pytest.mark.parametrize("k", [300.0, 1000.0, 1500.0])
def test_an_account_of_the_newest_force_misses_work_where_a_slow_blow_turns(k: float, delay: int) -> None:
    """Judged by the exact work of a force that is constant over each tick."""
    arm = _Contacts("boundless", 0.06, delay=delay)
    blow_J = 0.5 * ARM_KG * arm.speed**2
    missed = list[float]()
    over = list[float]()
    for _ in range(300):
        arm.blow(k, 0.0)
        missed.append((arm.work_J - arm.naive_J) / blow_J)
        over.append((float(arm.state["given_J"][0]) - arm.work_J) / blow_J)
    assert np.mean(missed) > 0.02
    assert -0.01 < np.mean(over) < 0.04


@shows("slow blow that turns between two counts", "ours")
@pytest.mark.daily("500.0-*-0.9-0.3", "1000.0-*-1.0-0.06", "1500.0-*-0.9-0.06", "3300.0-*-1.0-0.3")
@pytest.mark.parametrize("speed", [0.06, 0.3])
@pytest.mark.parametrize("restitution", [0.9, 1.0])
@pytest.mark.parametrize(("k", "delay"), [(500.0, 0), (1000.0, 1), (1500.0, 2), (3300.0, 3)])
def test_a_head_without_a_damper_does_not_drive_the_arm_for_two_thousand_contacts(
    k: float, delay: int, restitution: float, speed: float
) -> None:
    arm = _Contacts("ours", speed, restitution, delay)
    speeds = [speed]
    while len(speeds) < 2000 and speeds[-1] > 0.01:
        arm.speed = arm.blow(k, 0.0)
        speeds.append(arm.speed)
    assert max(speeds) < 1.1 * speed + 0.01  # a count within a tick is 3 cm/s
    assert np.mean(speeds[-10:]) < 0.07  # two counts in a tick


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
