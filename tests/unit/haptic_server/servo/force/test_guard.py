"""The guard by itself: its account of energy over several contacts, what it lets through, and where it gives up."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.parameters.rig import MAX_DELAY_TICKS
from haptic_server.records import NO_FAULT, NOT_A_NUMBER, READING, SELF_DRIVEN, STALLED
from haptic_server.servo.force import guard
from stability.catalogue import shows

T, M, LIMIT_N, COUNT_M = 1e-3, 0.075, 8.5, 3e-5


class Guard(NamedTuple):
    """A guard and what it may allow, shape (1,) each."""

    state: npt.NDArray[np.void]
    limits: npt.NDArray[np.void]

    def opened(self, v_in: float, now_ns: int = 0) -> int:
        return int(guard.begin_contact(self.state[0], self.limits[0], M, v_in, now_ns))

    def limited(self, head_N: float, pulse_N: float = 0.0, z: float = 0.0, v: float = 0.0) -> float:
        return float(guard.limit(self.state[0], self.limits[0], head_N, pulse_N, z, v, T))

    def stand(self, z: float) -> None:
        """The stick is at z, and all work up to there is counted."""
        self.state["z_m"] = self.state["counted_m"] = z
        self.state["least_N"], self.state["most_N"] = np.inf, -np.inf

    def of_state(self, name: str) -> float:
        return float(self.state[name][0])


def energy(speed: float) -> float:
    return 0.5 * M * speed * speed


@pytest.fixture
def held() -> Guard:
    """A guard whose ramp has risen, of a head that gives back half the speed of a blow."""
    made = Guard(np.zeros(1, guard.GUARD), np.zeros(1, guard.DEVICE_LIMITS))
    made.state["gain"], made.state["seen_above"], made.state["max_restitution"] = 1.0, 1, 0.5
    values: dict[str, Any] = {
        "max_force_N": LIMIT_N, "max_slew_N_per_s": 1e9, "max_speed_m_per_s": 1.5, "lowest_m": -0.1, "highest_m": 0.3,
        "ramp_s": 0.3, "resolution_m": COUNT_M, "m_kg": M,
    }  # fmt: skip
    for name, value in values.items():
        made.limits[name] = value
    return made


def test_what_a_contact_gave_too_much_is_owed_by_the_next_and_what_it_kept_is_not_saved(held: Guard) -> None:
    held.opened(-1.0)
    assert held.of_state("budget_J") == pytest.approx(
        -0.01 * energy(1.0)
    )  # it may give back all but a hundredth
    held.state["given_J"] = 0.02
    held.opened(-1.0)
    assert held.of_state("given_J") == pytest.approx(0.02)
    held.opened(-0.2)  # nothing is paid back by opening
    assert held.of_state("given_J") == pytest.approx(0.02)
    held.state["given_J"] = -0.03  # the head took more than it gave
    held.opened(-1.0)
    assert held.of_state("given_J") == 0.0


def test_a_debt_outlives_a_pause(held: Guard) -> None:
    held.opened(-1.0)
    held.state["given_J"] = 0.02
    guard.release_force(held.state[0])
    assert held.of_state("given_J") == pytest.approx(0.02)
    assert held.of_state("gain") == held.of_state("seen_above") == 0.0


def test_a_head_may_add_what_its_effects_are_meant_to(held: Guard) -> None:
    held.state["max_added_speed"] = 0.2  # leaves at 0.5 x 0.3 + 0.2 = 0.35 m/s
    held.opened(-0.3)
    assert held.of_state("budget_J") == pytest.approx(energy(0.35) - 1.01 * energy(0.3))
    held.state["given_J"] = held.of_state("budget_J") + 0.001
    held.opened(-0.3)
    assert held.of_state("given_J") == pytest.approx(0.001)


@shows("arm mass other than the scene's", "ours")
def test_a_live_mass_above_the_arms_own_raises_nothing(held: Guard) -> None:
    held.state["max_added_speed"] = 0.2
    guard.begin_contact(held.state[0], held.limits[0], 10.0 * M, -0.3, 0)
    assert held.of_state("budget_J") == pytest.approx(energy(0.35) - 1.01 * energy(0.3))


def test_a_head_in_debt_pushes_no_stick_that_leaves_and_brakes_one_that_comes(held: Guard) -> None:
    held.opened(-1.0)
    held.state["given_J"] = 0.02
    assert held.limited(5.0, z=-0.005, v=0.3) == pytest.approx(0.0, abs=1e-9)
    coming = held.limited(5.0, z=-0.005, v=-0.3)
    assert coming == pytest.approx(5.0)
    assert held.of_state("passivity_limited_ticks") == 1
    assert held.of_state("limited") == 1


def test_a_stick_at_rest_is_held_by_what_moves_it_a_centimetre_a_second(held: Guard) -> None:
    held.opened(-0.1)
    held.state["given_J"] = 0.02
    assert held.limited(5.0, z=-0.005, v=0.0) == pytest.approx(0.01 * M / T)


@pytest.mark.parametrize("delay", [0, 1, 4])
def test_what_the_account_lets_through_gives_no_more_than_is_left(held: Guard, delay: int) -> None:
    """A free mass, pushed as hard as the account allows, takes its budget and no more."""
    held.limits["delay_ticks"] = delay
    held.state["max_added_speed"] = 0.4
    held.opened(-0.3)
    budget = held.of_state("budget_J")
    z, v, given, coming = -0.001, 0.02, 0.0, [0.0] * delay
    for _ in range(100):
        coming.append(held.limited(4.0, z=z, v=v))
        acts = coming.pop(0)
        way = v * T + 0.5 * acts / M * T * T
        given += acts * way
        z, v = z + way, v + acts / M * T
    assert budget > 0.004
    assert 0.8 * budget < given <= 1.05 * budget


@pytest.mark.parametrize("delay", [0, 1, MAX_DELAY_TICKS])
def test_the_force_that_acted_is_the_one_of_so_many_ticks_ago_up_to_the_longest_delay(
    held: Guard, delay: int
) -> None:
    held.limits["delay_ticks"] = delay
    held.state["budget_J"] = 1.0
    held.stand(-0.001)
    held.limited(2.0, z=-0.001, v=-0.01)
    for _ in range(delay):
        held.limited(1.0, z=-0.001, v=-0.01)
    held.limited(1.0, z=-0.002, v=-0.01)
    assert held.of_state("given_J") == pytest.approx(-2.0 * 0.001)


def test_a_count_that_flips_is_no_motion(held: Guard) -> None:
    held.state["budget_J"], held.state["head_N"] = 1.0, 4.0
    held.stand(-0.001)
    for _ in range(50):  # and the force flips with it: work would be counted that nobody did
        held.limited(4.0, z=-0.001 + COUNT_M, v=-0.01)
        held.limited(5.0, z=-0.001, v=-0.01)
    assert held.of_state("given_J") == 0.0
    held.state["turned"] = 1
    held.limited(4.0, z=-0.001 + 2.0 * COUNT_M, v=-0.01)
    assert held.of_state("given_J") == pytest.approx(5.0 * 2.0 * COUNT_M)


def _moved(held: Guard, turned: int) -> float:
    """Work of moves of 0, 1, 1, 1 and 9 counts up from -1 mm, and what acted, in counts times N."""
    held.state["budget_J"], held.state["head_N"], held.state["turned"] = 1.0, 4.0, turned
    held.stand(-0.001)
    for force, counts in ((4.0, 0), (3.0, 1), (2.0, 1), (7.0, 1), (0.0, 9)):
        held.limited(force, z=-0.001 + counts * COUNT_M, v=-0.01)
    return held.of_state("given_J") / COUNT_M


def test_where_a_blow_turns_small_moves_have_the_mean_of_their_forces_and_the_turn_is_charged(
    held: Guard,
) -> None:
    unseen = 2.5 * (4.0 - 2.0)
    assert _moved(held, 0) == pytest.approx(0.5 * (2.0 + 4.0) * 1.0 + 7.0 * 8.0 + unseen)
    assert held.of_state("turned") == 1.0


def test_a_stick_that_has_turned_has_the_newest_force_until_the_next_contact(held: Guard) -> None:
    assert _moved(held, 1) == pytest.approx(7.0 * 9.0)
    held.opened(-0.3)
    assert held.of_state("turned") == 0.0


def test_a_blow_that_goes_down_turns_nothing(held: Guard) -> None:
    held.state["budget_J"], held.state["head_N"] = 1.0, 4.0
    held.stand(-0.001)
    for force, counts in ((4.0, 0), (5.0, -1), (0.0, -3)):
        held.limited(force, z=-0.001 + counts * COUNT_M, v=-0.01)
    assert held.of_state("given_J") == pytest.approx(-(4.0 * 1.0 + 5.0 * 2.0) * COUNT_M)
    assert held.of_state("turned") == 0.0


def test_thirteen_contacts_in_a_row_that_begin_in_debt_are_a_fault(held: Guard) -> None:
    codes = []
    for number in range(13):
        held.state["given_J"] = 0.01
        codes.append(held.opened(-0.5, number * 10**9))
    assert codes == [NO_FAULT] * 12 + [SELF_DRIVEN]
    held.state["given_J"] = 0.0
    assert held.opened(-0.5, 10**11) == NO_FAULT


@pytest.mark.parametrize(("given_J", "v_in"), [(0.9 * energy(0.05), -0.5), (0.01, -0.049)])
def test_a_debt_of_encoder_counts_or_under_a_resting_stick_is_none(
    held: Guard, given_J: float, v_in: float
) -> None:
    for number in range(40):
        held.state["given_J"] = given_J
        assert held.opened(v_in, number * 10**9) == NO_FAULT


def _saturated(held: Guard, every_ns: int, pulsed: bool = False, tiring: float = 1.0) -> int:
    code, speed = NO_FAULT, 0.5
    for number in range(1, 21):
        code = code or held.opened(-speed, number * every_ns)
        held.state["peak_N"], held.state["pulsed"] = LIMIT_N, int(pulsed)
        speed *= tiring
    return code


def test_contacts_at_the_limit_of_force_faster_than_a_hand_strikes_are_a_fault(held: Guard) -> None:
    assert _saturated(held, 40_000_000) == SELF_DRIVEN


def test_the_fourteenth_of_them_is_counted_from_the_first(held: Guard) -> None:
    """Thirteen in a row after one that was not; a break begins anew."""
    codes = []
    for number in range(1, 31):
        held.state["peak_N"] = 0.0 if number in (1, 5) else LIMIT_N
        codes.append(held.opened(-0.5, number * 40_000_000))
    assert codes.index(SELF_DRIVEN) == 17


@pytest.mark.parametrize("newest", range(guard.MEMORY))
def test_it_does_not_matter_where_the_ring_of_forces_begins(held: Guard, newest: int) -> None:
    """4 N of three ticks ago, and 1 N on its way: what is left of the account buys so much force and no more."""
    held.limits["delay_ticks"], held.state["newest"] = 3, newest
    held.state["budget_J"] = 0.0005
    held.stand(-0.01)
    ring = held.state["head_N"][0]
    for ago, force_N in enumerate((1.0, 1.0, 1.0, 4.0)):
        ring[(newest - ago) % guard.MEMORY] = force_N
    found = held.limited(8.0, z=-0.009, v=0.01)
    assert held.of_state("given_J") == pytest.approx(4.0 * 0.001)
    held.state["given_J"], held.state["newest"] = 0.0, newest
    ring[(newest + 1) % guard.MEMORY] = 0.0
    again = held.limited(8.0, z=-0.009, v=0.01)
    # By hand: v in the middle of the tick that 4 N act in, then a tick of 1 N three times, then F (v T + c F) = left.
    v, c, left = 0.01 + 0.5 * T * 4.0 / M, 0.5 * T * T / M, 0.0005
    for _ in range(3):
        left -= v * T + c
        v += T / M
    most = (-v * T + (v * v * T * T + 4.0 * c * left) ** 0.5) / (2.0 * c)
    assert found == 0.0
    assert again == pytest.approx(most)


@pytest.mark.parametrize(
    "but",
    [
        {"every_ns": 81_000_000},
        {"every_ns": 40_000_000, "pulsed": True},
        {"every_ns": 40_000_000, "tiring": 0.9},
    ],
)
def test_a_hand_pulses_or_a_roll_that_tires_are_none(held: Guard, but: dict[str, Any]) -> None:
    assert _saturated(held, **but) == NO_FAULT


def test_a_debt_beyond_half_a_blow_is_a_fault_at_once(held: Guard) -> None:
    held.opened(-1.2)
    for share, code in ((0.49, NO_FAULT), (0.51, SELF_DRIVEN)):
        held.state["given_J"] = share * energy(1.2)
        assert guard.check_energy(held.state[0], held.limits[0]) == code
    held.opened(-0.1)  # of a light blow: below the energy of 0.5 m/s it is none
    for speed, code in ((0.49, NO_FAULT), (0.51, SELF_DRIVEN)):
        held.state["given_J"] = energy(speed)
        assert guard.check_energy(held.state[0], held.limits[0]) == code


@pytest.mark.parametrize("room_m", [0.0, 0.001, 0.005, 0.009])
def test_near_the_lowest_position_the_force_is_a_share_of_the_motors_not_of_what_is_asked(
    held: Guard, room_m: float
) -> None:
    held.state["budget_J"] = 1.0
    assert held.limited(400.0, z=-0.1 + room_m) == pytest.approx(LIMIT_N * room_m / 0.01)
    assert held.limited(2.0, z=-0.1 + room_m) == pytest.approx(2.0 * room_m / 0.01)


def test_the_ramp_is_a_share_of_the_motors_too(held: Guard) -> None:
    held.state["budget_J"], held.state["gain"] = 1.0, 0.25
    assert held.limited(400.0) == pytest.approx(0.25 * LIMIT_N)
    assert held.of_state("limited") == 1
    assert held.limited(4.0) == pytest.approx(1.0)
    assert held.of_state("limited") == 1


def test_a_force_grows_and_falls_by_the_slew_times_the_tick(held: Guard) -> None:
    held.limits["max_slew_N_per_s"], held.state["budget_J"] = 2000.0, 1.0
    forces = [held.limited(8.0) for _ in range(5)]
    assert forces == pytest.approx([2.0, 4.0, 6.0, 8.0, 8.0])
    assert held.of_state("limited") == 3
    assert held.limited(0.0) == pytest.approx(6.0)


def test_a_limit_takes_from_the_pulse_first(held: Guard) -> None:
    held.state["budget_J"] = 1.0
    assert held.limited(5.0, pulse_N=6.0) == LIMIT_N
    assert guard.last_head_force(held.state[0]) == pytest.approx(LIMIT_N - 6.0)
    assert held.of_state("pulsed") == 1
    assert held.of_state("peak_N") == LIMIT_N


@pytest.mark.parametrize(
    ("span_s", "code", "seen"),
    [(0.0049, NO_FAULT, 1), (0.0051, NO_FAULT, 0), (0.0199, NO_FAULT, 0), (0.0201, STALLED, 1)],
)
def test_a_stall(held: Guard, span_s: float, code: int, seen: int) -> None:
    reading = np.zeros(1, READING)
    reading["fresh"] = 1
    assert guard.check_reading(held.state[0], held.limits[0], reading[0], 10**9, span_s) == code
    assert held.of_state("seen_above") == seen


def test_the_ramp_takes_its_time_and_begins_a_millimetre_above_the_head(held: Guard) -> None:
    reading = np.zeros(1, READING)
    guard.release_force(held.state[0])
    for z, gain in ((0.0009, 0.0), (0.0011, 0.0), (-0.01, T / 0.3), (-0.01, 2.0 * T / 0.3)):
        assert guard.advance_ramp(held.state[0], held.limits[0], reading[0], z, T) == NO_FAULT
        assert held.of_state("gain") == pytest.approx(gain)
    for _ in range(310):
        guard.advance_ramp(held.state[0], held.limits[0], reading[0], 0.0, T)
    assert held.of_state("gain") == 1.0


@pytest.mark.parametrize("axis", ["x_m", "y_m", "z_m"])
def test_a_place_a_kilometre_away_is_no_number(held: Guard, axis: str) -> None:
    held.limits["lowest_m"], held.limits["highest_m"] = -1e4, 1e4
    for place, code in (
        (999.0, NO_FAULT),
        (-999.0, NO_FAULT),
        (1001.0, NOT_A_NUMBER),
        (-1001.0, NOT_A_NUMBER),
    ):
        reading = np.zeros(1, READING)
        reading["fresh"], reading[axis] = 1, place
        assert guard.check_reading(held.state[0], held.limits[0], reading[0], 10**9, T) == code
