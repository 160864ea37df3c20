"""The table of permission on real processes: stopped, killed and started anew, they go where the table says.

A machine that stands still for more than 20 ms makes a fault by itself; that is an event of the table like any other,
and the step that it disturbed is taken again.
"""

import math
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator

import pytest
import zenoh
from rig_process import (
    DRUMSTICK,
    PATIENCE_S,
    Listener,
    Rig,
    ask,
    is_alive,
    reason_of,
    replies,
    reply_to,
    running,
    wait_for,
)

from haptic_server import files, permission
from haptic_server.permission import EVENTS, FAULTED, FREE, MAY_PUSH, PANICKED, REFUSED, STATES, after
from haptic_server.records import FAULT_WORDS, STALE, STALLED
from permission_walk import walk
from protocol.messages import LeaseRequest, State, encode
from rig.folder import run_folder

SERVO, GATEWAY = "haptic_server.servo", "haptic_server.gateway"
STILL = (FAULT_WORDS[STALLED], FAULT_WORDS[STALE])
SILENT = "the servo process does not tick"
STOPPED_S = 0.06  # three times what is a fault
MAX_TRIES = 5
STATES_SEEN = 3  # of a servo that is held: so many in a row are without force


def told(state: State) -> int:
    """State of the table that it tells."""
    return {"ready": FREE, "playing": FREE, "panic": PANICKED}.get(state.status, FAULTED)


class Played:
    """A rig, and everything that its gateways told of the servo's state."""

    def __init__(self, rig: Rig, session: zenoh.Session) -> None:
        self.rig, self.session = rig, session
        self.states = Listener(session, rig.keys.state, State)
        self.told_ns = 0  # what was told of ticks before says nothing about the newest event
        self.boot = 0
        self.acts: dict[int, Callable[[], None]] = {
            permission.PANIC: lambda: self.answered(rig.keys.panic),
            permission.FAULT: self.stall,
            permission.ARM: self.arm,
            permission.SERVO: lambda: self.kill(SERVO),
            permission.GATEWAY: lambda: self.kill(GATEWAY),
            permission.SCENE: self.another_scene,
            permission.SET: lambda: self.answered(rig.keys.set_many, {"dv_pls": 0.05}),
            permission.LEASE: self.lease,
        }

    def answered(self, key: str, payload: object = None) -> None:
        ask(self.session, key, payload)

    def arm(self) -> None:
        subprocess.run([*DRUMSTICK, "arm", "--rig", self.rig.name], check=True, timeout=PATIENCE_S)

    def pid(self, module: str) -> int:
        return wait_for(module, lambda: self.rig.children().get(module))

    def stall(self) -> None:
        """Stop the servo for longer than its guard allows."""
        servo = self.pid(SERVO)
        os.kill(servo, signal.SIGSTOP)
        try:
            end = time.monotonic() + STOPPED_S
            wait_for("the stall", lambda: time.monotonic() > end)
        finally:
            os.kill(servo, signal.SIGCONT)

    def kill(self, module: str) -> None:
        """SIGKILL, and wait for the one that is started in its place."""
        old = self.pid(module)
        os.kill(old, signal.SIGKILL)
        wait_for(f"another {module}", lambda: self.rig.children().get(module, old) != old)
        if module == GATEWAY:
            self.gateway_answers()
        else:
            self.boot_is_new()

    def gateway_answers(self) -> None:
        wait_for("its answer", lambda: replies(self.session, self.rig.keys.clock))

    def boot_is_new(self) -> None:
        wait_for("a new servo", lambda: any(s.boot > self.boot and s.t_ns > 0 for s in self.states.got[-3:]))

    def another_scene(self) -> None:
        """Ask for one; RefusalReply's words raise PermissionError."""
        refused = self.ask_for_scene()
        if refused:
            raise PermissionError(refused)
        self.boot_is_new()
        self.gateway_answers()

    def ask_for_scene(self) -> str:
        payload = b"\x92\x01\xa7phantom"  # laid out anew, a scene of the same name is another one too
        reply = reply_to(self.session, self.rig.keys.scene_load, payload)
        return "" if reply.ok else reason_of(reply)

    def lease(self) -> None:
        for seconds in (1.0, 0.0):
            request = encode(LeaseRequest(who="mine", name="a test", seconds=seconds))
            reply = reply_to(self.session, self.rig.keys.lease, request)
            assert reply.ok is not None, reply.err.payload.to_bytes()

    def since(self) -> list[State]:
        """Ticks that were told after the newest event. A servo that has not ticked for a while tells nothing."""
        return [s for s in self.states.got[-100:] if s.t_ns > self.told_ns and not s.status.endswith(SILENT)]

    def state(self) -> int:
        """State after the newest event, with the force that belongs to it."""
        first = wait_for("a state", self.since)[0]
        self.boot, where = first.boot, told(first)
        if MAY_PUSH[where]:
            # It pushes, or stands in a fault by itself.
            return told(
                wait_for(
                    "a push",
                    lambda: next((s for s in self.since() if s.force_N > 0.0 or told(s) != where), None),
                )
            )
        wait_for("more states", lambda: len(self.since()) > STATES_SEEN)
        held = self.since()
        assert all(s.force_N == 0.0 and s.strikes == first.strikes for s in held), held
        return told(held[-1])

    def cause(self, event: int, state: int) -> int:
        """Make it happen in this state; the state after it."""
        try:
            self.acts[event]()
        except PermissionError as refused:
            assert EVENTS[event].then[state] == REFUSED, refused
            assert "is latched" in str(refused)
        else:
            assert EVENTS[event].then[state] != REFUSED, EVENTS[event].name
        self.told_ns = time.monotonic_ns()
        return self.state()

    def bring_to(self, state: int) -> bool:
        """By arm, panic and fault; whether it is there."""
        now = self.state()
        if now != state and now != FREE:
            now = self.cause(permission.ARM, now)
        if now != state and now == FREE:
            now = self.cause(permission.PANIC if state == PANICKED else permission.FAULT, now)
        return now == state

    def step(self, state: int, event: int) -> None:
        """One event of a trace: from this state to the one that the table says."""
        expected = after(state, event)
        for _ in range(MAX_TRIES):
            if not self.bring_to(state):
                continue
            reached = self.cause(event, state)
            if reached == expected:
                return
            # Never free where it should be held, and no fault but the machine's own.
            assert reached == FAULTED, (STATES[state], EVENTS[event].name, STATES[reached])
            assert self.since()[-1].status.removeprefix("fault: ") in STILL, self.since()[-1]
        raise AssertionError(f"{STATES[state]}, {EVENTS[event].name}: disturbed {MAX_TRIES} times")


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    # A sampled arm, the only kind that can stall: a stroke every half second, 2 mm into the head.
    rows = [f"{0.001 * k:.3f},{0.008 + 0.01 * math.cos(4e-3 * math.pi * k):.6f}" for k in range(501)]
    strokes = tmp_path_factory.mktemp("recorded") / "strokes.csv"
    strokes.write_text("\n".join(["t_s,z_m", *rows]) + "\n")
    with running("haptic", "--scene", "phantom", "--device", f"replay:{strokes}") as started:
        yield started


@pytest.fixture(scope="module")
def played(rig: Rig, session: zenoh.Session) -> Played:
    return Played(rig, session)


def test_the_walk_takes_every_event_in_every_state() -> None:
    state, taken = FREE, set[tuple[int, int]]()
    for event in walk():
        taken.add((state, event))
        state = after(state, event)
    assert len(taken) == len(STATES) * len(EVENTS)


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_the_processes_go_where_the_table_says(played: Played) -> None:
    state = FREE
    for event in walk():
        played.step(state, event)
        state = after(state, event)


def test_a_panic_that_only_a_dead_servo_had_outlives_its_gateway(played: Played) -> None:
    assert played.bring_to(FREE)
    servo, gateway = played.pid(SERVO), played.pid(GATEWAY)
    supervisor = played.rig.process.pid
    os.kill(supervisor, signal.SIGSTOP)  # nobody starts anything for a while
    try:
        os.kill(servo, signal.SIGKILL)
        wait_for("its end", lambda: not is_alive(servo))
        played.answered(played.rig.keys.panic)
        os.kill(gateway, signal.SIGKILL)
        wait_for("its end", lambda: not is_alive(gateway))
    finally:
        os.kill(supervisor, signal.SIGCONT)
    played.boot_is_new()
    played.gateway_answers()
    played.told_ns = time.monotonic_ns()
    assert played.state() != FREE


@pytest.mark.long
def test_a_servo_that_is_killed_as_it_starts_leaves_the_panic_to_the_next(played: Played) -> None:
    block = run_folder(played.rig.name) / files.BLOCK
    played.bring_to(PANICKED)
    assert played.state() != FREE
    for _ in range(2):  # the second one as soon as its block is there
        before, servo = block.stat().st_ino, played.pid(SERVO)
        os.kill(servo, signal.SIGKILL)
        end = time.monotonic() + PATIENCE_S
        while block.stat().st_ino == before and time.monotonic() < end:
            time.sleep(0)
    played.told_ns = time.monotonic_ns()
    assert played.state() != FREE
