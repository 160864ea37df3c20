"""The hand that follows a pointer: what it does with whatever stands in the block, and what that makes of the stick."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.block_header import ARM, PANIC
from haptic_server.records import FAULT, NO_FAULT, POINTER, RELEASE, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.device.pointer import Pointed
from haptic_server.servo.device.selection import chosen
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation.pointed_hand import HAND, LIFTED_M, STALE_NS, follow, height_of, top_of
from realtime import triple_buffer
from realtime.atomics import add_to, poke

T_NS = 1_000_000
FRAME = 16  # ticks between two frames of a screen
ROLL = parse(shipped_text("roll"), "roll")
ARM_SCENE = sampled_arm.scene()


def servo_of(scene: Scene) -> Servo:
    device = Pointed(scene)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


class Player:
    """Points at one servo in virtual time, once a frame, as a page does."""

    def __init__(self, servo: Servo) -> None:
        self.servo = servo
        self.now_ns = 1_000_000_000
        self.lifts: list[float] = []
        self.heights: list[float] = []

    def write(self, held: bool, lift: float, x: float = 0.0, y: float = 0.0, t_ns: int | None = None) -> None:
        record = np.zeros(1, POINTER)
        record["t_ns"] = self.now_ns if t_ns is None else t_ns
        record["held"], record["lift"], record["x"], record["y"] = held, lift, x, y
        triple_buffer.publish(self.servo.block.pointer_cells, self.servo.block.pointer, record[0])

    def tick(self, ticks: int) -> None:
        for _ in range(ticks):
            self.now_ns = loop.run_virtual(self.servo, 1, self.now_ns)
            self.lifts.append(float(self.servo.pointed[0]["lift"]))
            self.heights.append(float(self.servo.status[0]["z_m"]))

    def hold(self, seconds: float, lift: float, x: float = 0.0, y: float = 0.0) -> None:
        for _ in range(round(seconds * 1e9 / T_NS / FRAME)):
            self.write(True, lift, x, y)
            self.tick(FRAME)

    def strikes(self) -> np.ndarray:
        events = sampled_arm.events_of(self.servo)
        return events[events["kind"] == STRIKE]


@pytest.mark.parametrize("scene", [ROLL, ARM_SCENE], ids=["stick", "arm"])
def test_nobody_points_and_nothing_happens(scene: Scene) -> None:
    player = Player(servo_of(scene))
    player.tick(3000)
    assert len(player.strikes()) == 0
    assert min(player.heights) > 0.5 * LIFTED_M
    assert player.servo.status[0]["fault"] == NO_FAULT


@pytest.mark.parametrize("scene", [ROLL, ARM_SCENE], ids=["stick", "arm"])
def test_a_stroke_strikes_where_it_points_and_lifting_ends_it(scene: Scene) -> None:
    player = Player(servo_of(scene))
    player.tick(400)
    player.hold(0.25, 1.0, x=0.6, y=-0.3)  # over the head first
    assert len(player.strikes()) == 0
    player.hold(0.1, 0.0, x=0.6, y=-0.3)
    player.hold(0.9, 1.0, x=0.6, y=-0.3)
    strikes = player.strikes()
    assert len(strikes) >= 1
    np.testing.assert_allclose(strikes["x"], 0.6, atol=1e-6)
    np.testing.assert_allclose(strikes["y"], -0.3, atol=1e-6)
    assert np.all(strikes["speed_m_per_s"] > 0.05)
    player.tick(1000)
    assert len(player.strikes()) == 0


def test_holding_it_down_is_the_papers_roll() -> None:
    """A hand that holds its spring at z_ss is the simulated hand: the roll settles at the same rate."""
    player = Player(servo_of(ROLL))
    player.hold(4.0, 0.0)
    pointed = player.servo.status[0]["roll_rate_Hz"]
    simulated = memory.prepare(ROLL, blocks.in_memory(law_of(ROLL)))
    loop.run_virtual(simulated, 4000, 0)
    assert pointed == pytest.approx(simulated.status[0]["roll_rate_Hz"], rel=1e-6)
    assert pointed == pytest.approx(23.05, abs=0.01)


def test_a_pointer_that_falls_silent_has_let_go() -> None:
    player = Player(servo_of(ROLL))
    player.hold(1.0, 0.0)
    assert len(player.strikes()) > 10
    player.tick(STALE_NS // T_NS)
    player.strikes()
    player.tick(300)  # up it goes
    player.strikes()
    player.tick(1000)
    assert len(player.strikes()) == 0
    assert player.lifts[-1] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("late_ns", [-2 * STALE_NS, 2 * STALE_NS, 10**18, -(10**18)])
def test_a_time_that_cannot_be_is_nobody(late_ns: int) -> None:
    player = Player(servo_of(ROLL))
    for _ in range(200):
        player.write(True, 0.0, t_ns=player.now_ns - late_ns)
        player.tick(1)
    assert min(player.lifts) == 1.0


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0, 1, -7, 2**62]),
            st.floats(),
            st.floats(),
            st.floats(),
            st.integers(-(2**63), 2**63 - 1) | st.just(None),
        ),
        min_size=1,
        max_size=60,
    ),
    st.floats(1e-4, 0.02),
)
def test_whatever_stands_in_the_block_the_hand_stays_in_its_travel_and_under_its_speed(
    frames: list[tuple[int, float, float, float, int | None]], span_s: float
) -> None:
    hand = np.zeros(1, HAND)
    hand["wish"] = hand["lift"] = 1.0
    hand["height_m"], hand["fastest_m_per_s"] = 0.04, 0.5
    block, rest, now = _BLOCK, -0.02, 10**9
    heights, places = [height_of(hand[0], rest)], [(0.0, 0.0)]
    for held, lift, x, y, t_ns in frames:
        record = np.zeros(1, POINTER)
        record["t_ns"] = now if t_ns is None else t_ns
        record["held"], record["lift"], record["x"], record["y"] = held, lift, x, y
        triple_buffer.publish(block.pointer_cells, block.pointer, record[0])
        now += int(span_s * 1e9)
        follow(hand[0], block, rest, now, span_s)
        heights.append(height_of(hand[0], rest))
        places.append((float(hand["x"][0]), float(hand["y"][0])))
    assert all(rest - 1e-12 <= z <= top_of(hand[0], rest) + 1e-12 for z in heights)
    assert np.max(np.abs(np.diff(heights))) <= 0.5 * span_s * (1.0 + 1e-9)
    assert np.max(np.abs(places)) <= 1.0


_BLOCK = blocks.in_memory(law_of(ROLL))


def test_between_frames_the_hand_moves_smoothly() -> None:
    """Steps of 60 Hz become one movement: no jerk at a frame, a lag of two filter times, no overshoot."""
    player = Player(servo_of(ROLL))
    for frame in range(60):
        player.write(True, 0.5 + 0.4 * math.cos(2.0 * math.pi * frame / 60.0))
        player.tick(FRAME)
    steps = np.diff(np.array(player.lifts[2 * FRAME :]))
    assert np.max(np.abs(np.diff(steps))) < 0.15 * np.max(np.abs(steps))
    frames = np.abs(np.diff(np.array(player.lifts[::FRAME])))
    assert np.max(np.abs(steps)) < 1.6 * np.max(frames) / FRAME


@pytest.mark.parametrize("scene", [ROLL, ARM_SCENE], ids=["stick", "arm"])
def test_a_pointer_clears_no_panic_and_moves_nothing_meanwhile(scene: Scene) -> None:
    player = Player(servo_of(scene))
    player.hold(0.5, 0.0)
    add_to(player.servo.block.control, PANIC, 1)
    player.tick(2)
    player.strikes()
    for lift in (1.0, 0.0, 1.0, 0.0):
        player.hold(0.3, lift)
    assert len(player.strikes()) == 0
    assert player.servo.tick_state[0]["panicked"] == 1
    assert player.servo.tick_state[0]["force_N"] == 0.0
    poke(player.servo.block.control, ARM, 1)
    player.hold(0.6, 1.0)
    player.hold(0.5, 0.0)
    assert len(player.strikes()) >= 1


def test_every_strike_gets_its_release_however_wildly_one_points() -> None:
    player = Player(servo_of(ROLL))
    rng = np.random.default_rng(5)
    for _ in range(300):
        player.write(bool(rng.random() < 0.9), float(rng.random()), float(rng.uniform(-1, 1)))
        player.tick(int(rng.integers(1, 60)))
    player.write(False, 1.0)
    player.tick(2000)
    events = sampled_arm.events_of(player.servo)
    kinds = events["kind"]
    assert np.count_nonzero(kinds == STRIKE) > 20
    assert np.array_equal(kinds, np.tile([STRIKE, RELEASE], len(kinds) // 2))
    assert player.servo.status[0]["status"] != FAULT


def test_a_shaken_arm_meets_the_guard_not_the_limit_of_the_hand() -> None:
    """The hand's speed is half the guard's limit; strokes as fast as the pointer may go do not fault the arm."""
    player = Player(servo_of(ARM_SCENE))
    player.tick(400)
    for _ in range(5):
        player.hold(0.25, 0.0)
        player.hold(0.75, 1.0)
    assert player.servo.status[0]["fault"] == NO_FAULT
    assert len(player.strikes()) >= 5


def test_a_lower_z_ss_lowers_the_hand_live() -> None:
    player = Player(servo_of(ROLL))
    player.hold(2.0, 0.0)
    slow = player.servo.status[0]["roll_rate_Hz"]
    wanted = player.servo.block.wanted[:1].copy()
    wanted["law"] = player.servo.law
    wanted["revision"] = 5
    wanted["law"]["z_ss"] = -0.03
    triple_buffer.publish(player.servo.block.wanted_cells, player.servo.block.wanted, wanted[0])
    player.hold(3.0, 0.0)
    assert player.servo.tick_state[0]["revision"] == 5
    assert player.servo.law[0]["z_ss"] == -0.03
    assert player.servo.status[0]["roll_rate_Hz"] > 1.1 * slow


def test_no_other_device_lets_itself_be_pointed_at() -> None:
    for words in ("simulated", "openhaptics", "replay:nowhere.csv"):
        device = chosen(words, ROLL)
        block = blocks.in_memory(law_of(ROLL))
        if words == "simulated":
            servo = device.attach_simulation(memory.prepare(ROLL, block))
            assert servo.pointed is None
        assert not block.is_pointed
    assert servo_of(ROLL).block.is_pointed
