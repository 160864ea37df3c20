"""The table of permission, row by row, on the real compiled tick of both plants, and on the gateway's parameters."""

import math
from pathlib import Path

import pytest

import live_sets
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import block_header, permission
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.settings import Parameters
from haptic_server.permission import EVENTS, FAULTED, FREE, MAY_PUSH, PANICKED, REFUSED, STATES
from haptic_server.records import FAULT, PANIC, PLAYING, READY, TOO_FAST
from haptic_server.servo import loop
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import event_output, memory, orders
from protocol.requests import ANYBODY, Claim
from realtime.atomics import add_to, peek, poke

PLANTS = ("stick", "arm")
STATE_OF = {READY: FREE, PLAYING: FREE, PANIC: PANICKED, FAULT: FAULTED}
SECONDS = 3000


class Bench:
    """A servo in virtual time, its gateway's parameters, and everything that may happen to them."""

    def __init__(self, folder: Path, plant: str) -> None:
        self.folder = folder
        self.scene = live_sets.scene_of(plant)
        self.now = 0
        self.servo_starts()
        self.gateway_starts()

    def servo_starts(self) -> None:
        device = Simulated(self.scene)
        block = blocks.create(self.folder, law_of(self.scene))
        self.servo = device.attach_simulation(
            memory.prepare(self.scene, block, specification=device.info().specification)
        )
        self.tick()

    def gateway_starts(self) -> None:
        self.link = ServoLink(self.folder, law_of(self.scene))
        self.parameters = Parameters(self.scene, self.link, live_sets.limits_for(self.scene))

    def tick(self) -> float:
        self.now = loop.run_virtual(self.servo, 1, self.now)
        return float(self.servo.tick_state["force_N"][0])

    def cause(self, event: int, claim: Claim = ANYBODY) -> None:
        """Make it happen on the real parts; raises Refusal."""
        if event == permission.PANIC:
            self.parameters.panic("test")
        elif event == permission.FAULT:
            moved = self.servo.plant if self.servo.plant is not None else self.servo.motion
            before = moved.copy()
            moved[0]["z" if self.servo.plant is None else "z_m"] = math.nan
            self.tick()
            moved[:] = before
        elif event == permission.ARM:
            poke(self.servo.block.control, block_header.ARM, 1)
        elif event == permission.SERVO:
            self.servo_starts()
        elif event == permission.GATEWAY:
            self.gateway_starts()
        elif event == permission.SCENE:
            self.parameters.require_quiet(claim)
            block_header.invalidate(self.folder)
            self.servo_starts()
        elif event == permission.SET:
            self.parameters.set({"dv_pls": 0.05}, "test", claim)
        elif event == permission.LEASE:
            self.parameters.take_lease(claim.lease or "mine", "a test", 1.0)
        self.tick()

    def bring_to(self, state: int) -> None:
        if state != FREE:
            self.cause(permission.PANIC if state == PANICKED else permission.FAULT)
        assert self.state == state

    @property
    def state(self) -> int:
        return STATE_OF[int(self.servo.status["status"][0])]

    def pushes(self) -> bool:
        """True when any force comes within three seconds."""
        return any(self.tick() != 0.0 for _ in range(SECONDS))


@pytest.mark.parametrize("event", range(len(EVENTS)), ids=[row.name for row in EVENTS])
@pytest.mark.parametrize("state", range(len(STATES)), ids=STATES)
@pytest.mark.parametrize("plant", PLANTS)
def test_every_event_in_every_state(tmp_path: Path, plant: str, state: int, event: int) -> None:
    bench = Bench(tmp_path, plant)
    bench.bring_to(state)
    refused = EVENTS[event].then[state] == REFUSED
    try:
        bench.cause(event)
    except Refusal as why:
        assert refused, why
        assert "drumstick arm" in str(why)
    else:
        assert not refused
    assert bench.state == permission.after(state, event)
    assert block_header.was_held(tmp_path) == (not MAY_PUSH[bench.state])
    assert bench.pushes() == MAY_PUSH[bench.state]
    assert bench.state == permission.after(state, event)


@pytest.mark.parametrize("event", range(len(EVENTS)), ids=[row.name for row in EVENTS])
def test_what_passes_beside_somebody_elses_lease(tmp_path: Path, event: int) -> None:
    bench = Bench(tmp_path, "stick")
    bench.parameters.take_lease("theirs", "somebody else", 5.0)
    # A new gateway knows of no lease, and nobody asks one for what happens in the servo.
    try:
        bench.cause(event, Claim(lease="mine"))
    except Refusal as why:
        assert not EVENTS[event].beside_lease
        assert "somebody else is tuning" in str(why)
    else:
        assert EVENTS[event].beside_lease


@pytest.mark.parametrize("plant", PLANTS)
def test_an_arm_given_before_a_fault_is_told_does_not_clear_it(tmp_path: Path, plant: str) -> None:
    bench = Bench(tmp_path, plant)
    control = bench.servo.block.control
    for _ in range(2):
        bench.servo.tick_state["fault"] = TOO_FAST  # found by this tick, which has obeyed its orders
        poke(control, block_header.ARM, 1)
        event_output.publish_status(bench.servo, bench.now)
        assert peek(control, block_header.ARM) == 0
        bench.tick()
        assert bench.state == FAULTED
        poke(control, block_header.ARM, 1)
        event_output.publish_status(bench.servo, bench.now)
        assert peek(control, block_header.ARM) == 1
        assert (
            orders.obey(bench.servo) == permission.ARM
        )  # and the same fault comes again on this very tick: news
    bench.tick()
    assert bench.state == FREE


@pytest.mark.parametrize("plant", PLANTS)
def test_a_panic_and_an_arm_in_one_tick_are_a_panic(tmp_path: Path, plant: str) -> None:
    bench = Bench(tmp_path, plant)
    bench.parameters.panic("test")
    poke(bench.servo.block.control, block_header.ARM, 1)
    bench.tick()
    bench.tick()
    assert bench.state == PANICKED


def test_panics_are_counted_whatever_the_count_is(tmp_path: Path) -> None:
    bench = Bench(tmp_path, "stick")
    for _ in range(3):
        add_to(bench.servo.block.control, block_header.PANIC, 1)
        bench.tick()
        assert bench.state == PANICKED
        bench.cause(permission.ARM)
        assert bench.state == FREE
