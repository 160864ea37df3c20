"""Contacts that hardly happen: grazes by 1e-12 m from above and from within, and a start deep in the head."""

import math
from fractions import Fraction

import pytest

import stick_cases
from drumstick.parameters.stick import Stick
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.motion import exact, stepping
from stability.catalogue import shows


def _free(k_coll: float, r_in: float, release: str, m: float = 0.015) -> Stick:
    return Stick(m, k_coll, r_in, 0.0, 0.0, 0.0, release)  # pyright: ignore[reportArgumentType]


def _starting(stick: Stick, z: float, v: float, contact_phase: int) -> tuple[Records, Records]:
    scene = stick_cases.scene(stick)
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["z"], motion["v"], motion["contact_phase"] = z, v, contact_phase
    return law, motion


def _next_events(law: Records, motion: Records, count: int, longest_s: float) -> list[int]:
    return [exact.advance(law[0], motion[0], longest_s)[0] for _ in range(count)]


def test_a_start_deep_in_the_head() -> None:
    """Let go at rest 3 mm deep, undamped: a quarter of a swing, out with the speed of the whole spring."""
    m, k_coll, depth_m = 0.015, 5000.0, 3e-3
    law, motion = _starting(_free(k_coll, 0.0, "paper"), -depth_m, 0.0, exact.CONTACT)
    event, moved = exact.advance(law[0], motion[0], 1.0)
    w = math.sqrt(k_coll / m)
    assert event == exact.RELEASE
    assert moved == pytest.approx(0.5 * math.pi / w, rel=1e-14)
    assert motion["v_out"][0] == pytest.approx(depth_m * w, rel=1e-14)
    assert motion["peak_N"][0] == pytest.approx(depth_m * k_coll, rel=1e-14)


@shows("graze", "ours")
@pytest.mark.parametrize("by_m", [1e-9, 1e-12, -1e-12, -1e-9])
def test_a_graze_from_above(by_m: float) -> None:
    """Swinging about z_ss the stick comes down to -by_m: a contact of the speed that energy gives, or none at all."""
    z_ss, k_hand, m = 0.01, 20.0, 0.015
    stick = Stick(m, 5000.0, 0.0, k_hand, 0.0, z_ss, "paper")
    top = 2.0 * z_ss + by_m
    deep = float(Fraction(top) - 2 * Fraction(z_ss))  # as the rounded numbers really have it
    law, motion = _starting(stick, top, 0.0, exact.ABOVE)
    period = 2.0 * math.pi * math.sqrt(m / k_hand)
    found: list[float] = []
    t = 0.0
    while t < 9.9 * period and motion["outcome"][0] == exact.MOVING:
        event, moved = exact.advance(law[0], motion[0], 9.9 * period - t)
        t += moved
        if event == exact.ENTRY:
            found.append(float(motion["v_in"][0]))
    if by_m < 0.0:
        assert found == []  # it may be told that it never returns, or play on above the head
    else:
        assert len(found) == 10
        # z is known to some 1e-18 m, the speed goes with the root of the depth.
        right = -math.sqrt(k_hand / m * deep * (2.0 * z_ss + deep))
        assert found == pytest.approx([right] * 10, rel=1e-16 / deep)


@shows("graze", "ours")
@pytest.mark.parametrize("by_m", [1e-9, 1e-12, -1e-12, -1e-9])
def test_a_graze_from_within(by_m: float) -> None:
    """In the head, undamped, the stick rises to by_m: it comes out with the speed that is left, or it is captured."""
    m, k_coll, k_hand = 0.015, 5000.0, 20.0
    rest = -0.004
    stick = Stick(m, k_coll, 0.0, k_hand, 0.0, rest * (k_coll + k_hand) / k_hand, "paper")
    rest = float(Fraction(k_hand) * Fraction(stick.z_ss_m) / Fraction(k_coll + k_hand))
    law, motion = _starting(stick, 2.0 * rest - by_m, 0.0, exact.CONTACT)
    over = float(2 * Fraction(rest) - Fraction(float(motion["z"][0])))
    first = _next_events(law, motion, 1, 10.0)[0]
    if by_m < 0.0:
        assert motion["outcome"][0] == exact.CAPTURED
        assert first != exact.RELEASE
    else:
        right = math.sqrt((k_coll + k_hand) / m * over * (over - 2.0 * rest))
        assert first == exact.RELEASE
        assert motion["v_out"][0] == pytest.approx(right, rel=1e-16 / over)
        # Out by so little, it meets the head again at once, with the same speed.
        assert _next_events(law, motion, 2, 1.0) == [exact.APEX, exact.ENTRY]
        assert motion["v_in"][0] == pytest.approx(-right, rel=1e-16 / over)


@shows("graze")
@pytest.mark.parametrize(("by_m", "seen"), [(1e-9, 0), (1e-6, 5)])
def test_a_fixed_step_does_not_see_a_graze(by_m: float, seen: int) -> None:
    """Ten swings that go by_m into the head, for 24 us or 0.8 ms each; RK4 at 1 kHz finds `seen` of them at most."""
    z_ss, k_hand, m = 0.01, 20.0, 0.015
    stick = Stick(m, 5000.0, 0.0, k_hand, 0.0, z_ss, "paper")
    longest_s = 9.9 * 2.0 * math.pi * math.sqrt(m / k_hand)
    entries = {True: 0, False: 0}
    for naive in entries:
        law, motion = _starting(stick, 2.0 * z_ss + by_m, 0.0, exact.ABOVE)
        t = 0.0
        while t < longest_s and motion["outcome"][0] == exact.MOVING:
            if naive:
                event, moved = stepping.unlocated(law[0], motion[0], longest_s - t, STEPPERS["rk4"], 1e-3)
            else:
                event, moved = exact.advance(law[0], motion[0], longest_s - t)
            t += moved
            entries[naive] += event == exact.ENTRY
    assert entries[True] <= seen
    assert entries[False] == 10
