"""A slow blow on a sampled arm: what the head holds back while it leaves; and above its surface it does nothing."""

import pytest

import sampled_arm
from drumstick.stick import contact
from drumstick.stick.motion import exact
from haptic_server.records import STRIKE
from haptic_server.servo.force import memory
from sampled_arm import PERIOD_NS, ask_once, events_of, see_once, servo_of


def _pushes(servo: memory.Servo, seen: list[tuple[float, float]]) -> list[float]:
    # What the head asks for at each position and speed, in turn, without a lead and without pulses.
    servo.plan["lead_s"], servo.law["pulse"]["dv_pls"] = 0.0, 0.0
    found: list[float] = []
    for tick, (z, v) in enumerate(seen):
        see_once(servo, z, v, (tick + 1) * PERIOD_NS)
        found.append(ask_once(servo, PERIOD_NS * 1e-9)[0])
    return found


@pytest.mark.parametrize(
    ("came_at", "share"), [(0.005, 0.8), (0.02, 0.8), (0.03, 0.9), (0.04, 1.0), (0.5, 1.0)]
)
def test_the_head_holds_back_a_fifth_at_most_while_a_slow_blow_leaves_it(
    came_at: float, share: float
) -> None:
    k, r, z = 3500.0, 2.0, -1e-4  # R_in - R_out of the scene
    way = [(1e-4, -came_at), (z, -came_at), (z, -0.001), (z, 0.0), (z, 0.004), (z, -0.004), (z, 0.004)]
    coming, turning, *later = _pushes(servo_of(sampled_arm.scene()), way)[1:]
    assert coming == pytest.approx(-k * z + r * came_at)
    assert turning == pytest.approx(-k * z + r * 0.001)
    still, leaving, sinking, held = later
    assert still == pytest.approx(share * -k * z)
    assert leaving == pytest.approx(share * (-k * z - r * 0.004))
    # It sinks again: from here on a hand holds it down, and feels the whole spring.
    assert sinking == pytest.approx(-k * z + r * 0.004)
    assert held == pytest.approx(-k * z - r * 0.004)


@pytest.mark.parametrize("release", [contact.PAPER, contact.UNILATERAL])
def test_above_its_surface_a_head_does_nothing_though_the_contact_lasts(release: int) -> None:
    """Two encoder counts, 60 um: the paper's head would pull there, and hold a light arm."""
    servo = servo_of(sampled_arm.scene())
    servo.law["release"] = release
    inside, above, falling = _pushes(servo, [(1e-4, -0.1), (-1e-5, -0.1), (4e-5, 0.01), (4e-5, -0.01)])[1:]
    assert inside > 0.0
    assert above == falling == 0.0
    assert servo.motion["contact_phase"][0] != exact.ABOVE
    assert [event["kind"] for event in events_of(servo)] == [STRIKE]
