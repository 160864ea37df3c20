"""Promises of every device (device.protocol), asked of every device that ships: see docs/devices.md."""

import math
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import every_device
from every_device import Case
from haptic_server.block_header import ARM, HEARTBEAT, PANIC, STOP
from haptic_server.records import NO_FAULT, STALLED, STATUS
from haptic_server.records import PANIC as IN_PANIC
from haptic_server.servo.device.protocol import Device, DeviceError
from haptic_server.servo.force.memory import Servo
from realtime import triple_buffer
from realtime.atomics import add_to, peek, poke
from realtime.stop import StopRequest

pytestmark = [
    pytest.mark.timeout(600),
    pytest.mark.real_clock,
    pytest.mark.daily("stick*", "phantom*", "openhaptics*"),
]
PATIENCE_S = 120.0
AGAIN_S = 1.0

NewCase = Callable[[], Case]
_SELF_MADE = {
    "stick": every_device.stick,
    "phantom": every_device.phantom,
    "replay": every_device.replay,
    "pointer-stick": every_device.pointer_stick,
    "pointer-arm": every_device.pointer_arm,
    "own": every_device.own,
}


@pytest.fixture(params=[*_SELF_MADE, pytest.param("openhaptics", marks=pytest.mark.needs("cc"))])
def new_case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> NewCase:
    name: str = request.param

    def make() -> Case:
        folder = tmp_path_factory.mktemp(name)
        if name == "openhaptics":
            built: Path = request.getfixturevalue("built")
            return every_device.openhaptics(folder, built)
        return _SELF_MADE[name](folder)

    return make


class Running:
    """A run on a thread of its own, looked at through the block as a gateway does."""

    def __init__(self, device: Device, servo: Servo) -> None:
        self.servo = servo
        self.stop = StopRequest()
        self.answers: list[int | BaseException] = []
        self._status = np.zeros(1, STATUS)
        self._thread = threading.Thread(target=self._run, args=(device,), daemon=True)
        self._thread.start()

    def _run(self, device: Device) -> None:
        try:
            self.answers.append(device.run(self.servo, self.stop))
        except BaseException as error:  # noqa: BLE001  told to the test's thread
            self.answers.append(error)

    def status(self) -> np.void:
        triple_buffer.read_into(self.servo.block.status_cells, self.servo.block.status, self._status)
        return self._status[0].copy()

    def until(self, what: Callable[[np.void], bool]) -> np.void:
        """The first status for which `what` holds, or the one of a run that has ended in a fault meanwhile."""
        end = time.monotonic() + PATIENCE_S
        while not what(status := self.status()):
            if self.answers or status["fault"] != NO_FAULT:
                break
            assert time.monotonic() < end, f"waited in vain; the last status: {status}"
            time.sleep(0.0005)
        return status

    def press(self, case: Case) -> None:
        """Press until the head pushes back. Where the machine stood still for over 5 ms on the way down, it does not
        until the stick was above it again: so press once more.
        """
        pressed_at = -math.inf

        def felt(status: np.void) -> bool:
            nonlocal pressed_at
            if time.monotonic() - pressed_at > AGAIN_S:
                pressed_at = time.monotonic()
                case.press(self.servo)
            return bool(status["force_N"] > 0.05)

        self.until(lambda status: status["tick"] >= 450 or not case.is_sampled)
        self.until(felt)

    def ask(self) -> None:
        self.stop.ask()

    def join(self) -> int:
        """Wait for the end; what `run` returned, or raises what it raised."""
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "run does not return"
        if isinstance(self.answers[0], BaseException):
            raise self.answers[0]
        return self.answers[0]


@contextmanager
def running(case: Case, servo: Servo) -> Generator[Running]:
    run = Running(case.device, servo)
    try:
        yield run
    finally:
        run.ask()
        run.join()


def undisturbed(new: NewCase, play: Callable[[Case, Servo], Running]) -> tuple[Case, Running]:
    """Open, warm up, play, close, again while the machine itself stood still for so long that a guard must hold."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        case = new()
        case.device.open()
        case.device.warm_up(case.servo())
        try:
            run = play(case, case.servo())
        finally:
            case.device.close()
        case.judge()
        if run.status()["fault"] != STALLED:
            return case, run
    raise AssertionError(
        f"this machine stood still for more than 20 ms in each attempt of {PATIENCE_S:.0f} s"
    )


def _plain_run(case: Case, servo: Servo) -> Running:
    with running(case, servo) as run:
        run.until(lambda status: status["tick"] >= 60)
    return run


def test_its_whole_life_in_order(new_case: NewCase) -> None:
    threads = set(threading.enumerate())
    _, run = undisturbed(new_case, _plain_run)
    assert run.answers == [NO_FAULT]
    assert run.status()["tick"] >= 60
    tasks = _tasks()  # what libraries start once is there by now; a driver's threads are none of Python's
    undisturbed(new_case, _plain_run)
    assert set(threading.enumerate()) <= threads
    end = time.monotonic() + PATIENCE_S
    while _tasks() > tasks:  # the kernel takes a thread away some time after it was joined
        assert time.monotonic() < end
        time.sleep(0.01)


def _tasks() -> int:
    folder = Path("/proc/self/task")
    return len(list(folder.iterdir())) if folder.exists() else 0


def test_close_may_come_at_any_time_and_twice(new_case: NewCase) -> None:
    never_opened = new_case()
    never_opened.device.close()
    never_opened.device.close()
    never_opened.judge()
    only_opened = new_case()
    only_opened.device.open()
    only_opened.device.close()
    only_opened.device.close()
    only_opened.judge()
    if only_opened.motors is not None:
        assert not np.any(only_opened.motors()), "a force without a run"


def test_what_it_tells_of_itself_is_possible(new_case: NewCase) -> None:
    case = new_case()
    case.device.open()
    info = case.device.info()
    case.device.close()
    told = info.specification
    assert told.name
    assert told.name.isprintable()
    assert all(words and words == words.strip() for words in info.words)
    assert len(told.workspace_m) == 3
    assert all(0.01 < extent < 3.0 for extent in told.workspace_m)
    assert 0.0 <= told.resolution_m < 1e-3
    assert 0.0 < told.continuous_force_N <= told.max_force_N
    assert told.stiffness_N_per_m > 0.0
    assert told.damping_N_s_per_m > 0.0
    rates = list(told.rates_Hz)
    assert rates
    assert rates == sorted(set(rates))
    assert 100 <= rates[0] <= rates[-1] <= 10_000
    assert case.scene.servo.rate_Hz in told.rates_Hz
    assert told.rate_words
    if case.is_sampled:
        assert told.resolution_m > 0.0
        assert math.isfinite(told.max_force_N)
        assert math.isfinite(told.stiffness_N_per_m)


def test_furnishing_and_rehearsing_leave_the_servos_block_alone(new_case: NewCase) -> None:
    case = new_case()
    case.device.open()
    servo, spare = case.servo(), case.servo()
    before = {name: getattr(servo.block, name).copy() for name in servo.block._fields if name != "lateness"}
    case.device.warm_up(spare)
    case.device.close()
    for name, was in before.items():
        np.testing.assert_array_equal(getattr(servo.block, name), was, err_msg=name)
    assert servo.status[0]["tick"] == 0
    assert case.device.attach_simulation(servo).block is servo.block
    if case.motors is not None:
        assert not np.any(case.motors()), "a force in a rehearsal"
    case.judge()


@pytest.mark.parametrize("by", ["request", "cell", "request that came first"])
def test_it_stops_when_asked_whoever_asks(new_case: NewCase, by: str) -> None:
    def play(case: Case, servo: Servo) -> Running:
        if by == "request that came first":
            run = Running(case.device, servo)
            run.ask()
        else:
            run = Running(case.device, servo)
            run.until(lambda status: status["tick"] >= 5)
            run.ask() if by == "request" else poke(servo.block.control, STOP, 1)
        run.join()
        return run

    _, run = undisturbed(new_case, play)
    assert run.answers == [NO_FAULT]


def test_every_tick_is_counted_and_time_goes_on(new_case: NewCase) -> None:
    seen: list[np.void] = []

    def play(case: Case, servo: Servo) -> Running:
        seen.clear()
        with running(case, servo) as run:
            seen.extend(run.until(lambda status, n=n: status["tick"] >= n) for n in (5, 100, 200))
        seen.append(run.status())
        return run

    _, run = undisturbed(new_case, play)
    assert run.servo.tick_state[0]["traced"] == run.servo.status[0]["tick"] == seen[-1]["tick"]
    ticks, times = ([int(status[name]) for status in seen] for name in ("tick", "t_ns"))
    assert ticks == sorted(ticks)
    assert times == sorted(times)
    assert len(set(times[:3])) == 3
    assert peek(run.servo.block.control, HEARTBEAT) > 0
    # Each period has its tick, or is counted as one that had none.
    periods = (times[2] - times[1]) / int(run.servo.plan[0]["period_ns"])
    told = ticks[2] - ticks[1] + int(seen[2]["overruns"]) - int(seen[1]["overruns"])
    assert told >= 0.7 * periods
    trace = run.servo.trace[: min(ticks[-1], len(run.servo.trace))]
    assert np.all(np.diff(np.sort(trace["t_ns"])) > 0)
    assert np.all(trace["span_s"] > 0.0)


def test_what_it_reads_is_finite_and_new(new_case: NewCase) -> None:
    case, run = undisturbed(new_case, _plain_run)
    status, reading = run.status(), run.servo.reading[0]
    assert all(math.isfinite(status[name]) for name in ("z_m", "v_m_per_s", "force_N", "x", "y"))
    assert max(abs(status["x"]), abs(status["y"])) <= 1.0
    assert np.all(np.isfinite(run.servo.trace["z_m"]))
    if case.is_sampled:
        assert all(math.isfinite(reading[name]) for name in ("x_m", "y_m", "z_m", "temperature"))
        assert reading["fresh"] in (0, 1)
        assert reading["trouble"] == NO_FAULT
        assert reading["t_ns"] > 0
        assert run.servo.guard[0]["fresh_ns"] > 0
        assert all(abs(reading[name]) < 1.0 for name in ("x_m", "y_m", "z_m"))


def _pressing(case: Case, servo: Servo) -> Running:
    # Stopped while the head pushes.
    run = Running(case.device, servo)
    run.press(case)
    run.ask()
    run.join()
    return run


def test_no_force_is_left_when_it_stops_in_mid_contact(new_case: NewCase) -> None:
    case, run = undisturbed(new_case, _pressing)
    felt = run.servo.trace["force_N"]
    assert felt.max() > 0.05, "the stick never pressed: nothing was tried"
    assert run.status()["force_N"] == 0.0
    if run.servo.plant is not None:
        assert run.servo.plant[0]["force_N"] == 0.0
    if case.motors is not None:
        motors = case.motors()
        assert motors.max() > 0.05
        assert motors[-1] == 0.0


def test_no_force_beyond_the_devices_own(new_case: NewCase) -> None:
    limit: list[float] = []

    def play(case: Case, servo: Servo) -> Running:
        limit[:] = [case.device.info().specification.max_force_N]
        return _pressing(case, servo)

    case, run = undisturbed(new_case, play)
    assert np.abs(run.servo.trace["force_N"]).max() <= limit[0]
    if case.motors is not None:
        assert np.abs(case.motors()).max() <= limit[0]


def test_a_panic_takes_all_force_away_until_it_is_armed(new_case: NewCase) -> None:
    forces: list[float] = []

    def play(case: Case, servo: Servo) -> Running:
        forces.clear()
        with running(case, servo) as run:
            run.press(case)
            add_to(servo.block.control, PANIC, 1)
            first = run.until(lambda status: status["status"] == IN_PANIC)
            forces.append(first["force_N"])
            last = run.until(lambda status: status["tick"] >= first["tick"] + 50)
            forces.append(last["force_N"])
            assert last["status"] == IN_PANIC or last["fault"] != NO_FAULT
            poke(servo.block.control, ARM, 1)
            run.until(lambda status: status["status"] != IN_PANIC)
        return run

    undisturbed(new_case, play)
    assert forces == [0.0, 0.0]


def test_a_rate_that_it_cannot_keep_is_refused_in_words_and_before_any_tick(new_case: NewCase) -> None:
    case = new_case()
    case.device.open()
    servo = case.servo(case.wrong_rate_hz)
    run = Running(case.device, servo)
    with pytest.raises(DeviceError, match=rf"{case.wrong_rate_hz} Hz.*\[servo\] rate_Hz"):
        run.join()
    assert servo.status[0]["tick"] == 0
    case.device.close()
    case.device.close()
    if case.motors is not None:
        assert not np.any(case.motors())
    case.judge()
