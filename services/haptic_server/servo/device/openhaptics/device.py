"""The PHANTOM as a device of the servo (device.protocol). Control thread for everything; see each part for its why."""

import logging
import time
from collections.abc import Callable
from typing import NamedTuple

from haptic_server.block_header import STOP
from haptic_server.records import NO_FAULT, SCHEDULER
from haptic_server.servo.device.openhaptics import calibration, facts, port, protection, rates, thread
from haptic_server.servo.device.openhaptics.callback import Callback, Rendering, conclude
from haptic_server.servo.device.openhaptics.driver import library, names, opening
from haptic_server.servo.device.openhaptics.driver.faults import is_hard, words_of
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.protocol import DeviceError, Info
from haptic_server.servo.force.memory import Servo
from realtime.atomics import peek, poke
from realtime.stop import StopRequest

_log = logging.getLogger("servo")
_POLL_S = 0.02
_SILENT_S = 0.5  # a driver that has not called for so long has ended its servo thread
_FIRST_S = 2.0  # and one that has not begun after so long will not


class _Open(NamedTuple):
    hd: Hd
    handle: int
    facts: facts.Facts
    has_switch: bool


class OpenHaptics:
    """A PHANTOM. `rendering` is compiled: (servo, reading, now_ns, span_s) -> N along z; `load` finds the library.

    `pose_is_held`: somebody holds the arm in its neutral pose now, so its encoders may be reset.
    """

    def __init__(
        self,
        rendering: Rendering,
        *,
        load: Callable[[], tuple[str, Hd]] = library.load,
        pose_is_held: bool = False,
    ) -> None:
        self._rendering = rendering
        self._load = load
        self._pose_is_held = pose_is_held
        self._open: _Open | None = None
        self._words: list[str] = []

    def open(self) -> None:
        """Load the driver, open the device, calibrate it, switch its protection on. No force yet; takes seconds."""
        if self._open is not None:
            raise DeviceError("the device is open already")
        name, hd = self._load()
        found = opening.open_device(hd)
        self._words = [f"{name}, opened as {found.name}"]
        try:
            how = calibration.calibrate(hd, self._pose_is_held)
            arm = facts.read(hd)
            hd.boolean(names.CURRENT_SAFETY_SWITCH)
            has_switch = not hd.errors()
            self._words += [*arm.words, how, *protection.protect(hd), protection.limits(hd).words()]
        except DeviceError:
            hd.disable_device(found.handle)
            raise
        if not has_switch:
            self._words.append("the driver does not tell of a safety switch")
        self._open = _Open(hd, found.handle, arm, has_switch)

    def info(self) -> Info:
        """Facts about the open device, and how its last run was scheduled. Does not block."""
        return Info(self._opened().facts.specification, tuple(self._words))

    def attach_simulation(self, servo: Servo) -> Servo:
        """Return the servo unchanged: a real arm moves nothing in our memory."""
        return servo

    def warm_up(self, spare: Servo) -> None:
        """Compile for servos of this type, so that `run` begins at once; else it compiles itself, in its own thread.

        Takes seconds. `spare` is like the servo to come, with a block that nobody reads; the device may be closed.
        """
        period_ns = int(spare.plan["period_ns"][0])
        Callback(self._rendering, spare, port.blank(period_ns))
        self._last_word(spare, SCHEDULER)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Have the driver tick until asked to stop; see device.protocol."""
        device = self._opened()
        rate_hz = round(1e9 / int(servo.plan["period_ns"][0]))
        self._set_rate(device.hd, rate_hz)
        gate = port.make(
            device.hd,
            device.handle,
            int(servo.plan["period_ns"][0]),
            device.facts.specification.max_force_N,
            device.facts.centre_mm,
            device.has_switch,
        )
        callback = Callback(self._rendering, servo, gate)
        handle = self._start(device.hd, callback)
        try:
            fault = self._watch(servo, gate, stop)
        finally:
            device.hd.stop_scheduler()  # the maker's order: first, so that no callback runs while it is taken out
            self._take_out(device.hd, handle)
        if fault != NO_FAULT:
            self._last_word(servo, fault)
        return fault

    def close(self) -> None:
        """Let go of the device."""
        if self._open is not None:
            self._open.hd.disable_device(self._open.handle)
            self._open = None

    def _opened(self) -> _Open:
        if self._open is None:
            raise DeviceError("the device is not open")
        return self._open

    def _say(self, words: str) -> None:
        # What is learnt while it runs; what `open` found is told by whoever opened it.
        self._words.append(words)
        _log.info("device: %s", words)

    def _set_rate(self, hd: Hd, rate_hz: int) -> None:
        hd.set_rate(rate_hz)
        if hd.errors():
            raise DeviceError(rates.refusal(rate_hz))
        driver_rate_Hz = hd.integer(names.UPDATE_RATE)
        if hd.errors() or driver_rate_Hz <= 0:
            self._say("the driver does not tell its rate")
        elif abs(driver_rate_Hz - rate_hz) > 1:
            raise DeviceError(
                f"the driver was asked for {rate_hz} Hz and says it runs at {driver_rate_Hz} Hz"
            )

    def _start(self, hd: Hd, callback: Callback) -> int:
        hd.errors()
        handle = hd.schedule(callback.function, callback.argument, names.MAX_SCHEDULER_PRIORITY)
        errors = hd.errors()
        if errors:
            raise DeviceError(f"the driver takes no servo callback: {errors[0]}")
        try:
            protection.output_force(hd, True)
            hd.start_scheduler()
            errors = hd.errors()
            if errors:
                raise DeviceError(f"the driver's scheduler does not start: {errors[0]}")
        except DeviceError:
            self._take_out(hd, handle)
            raise
        return handle

    def _take_out(self, hd: Hd, handle: int) -> None:
        hd.unschedule(handle)
        hd.errors()
        try:
            protection.output_force(hd, False)
        except (
            DeviceError
        ) as error:  # a device that is gone cannot be told; the fault that ended it matters more
            self._say(str(error))

    def _watch(self, servo: Servo, gate: port.Port, stop: StopRequest) -> int:
        # Polls: whoever wants to stop, the callback that has ended, the driver that no longer calls.
        ticks, since = 0, time.monotonic()
        while peek(gate.cells, port.ENDED) == 0:
            time.sleep(_POLL_S)
            if stop.is_set():
                poke(servo.block.control, STOP, 1)
            now, seen = time.monotonic(), int(peek(gate.cells, port.TICKS))
            if ticks == 0 and seen > 0:
                self._say(thread.request_real_time(int(peek(gate.cells, port.THREAD))))
            if seen != ticks:
                ticks, since = seen, now
            elif now - since > (_SILENT_S if ticks else _FIRST_S):
                break
        fault = int(peek(gate.cells, port.FAULT))
        if fault != NO_FAULT and is_hard(fault):
            error, internal = int(peek(gate.cells, port.ERROR)), int(peek(gate.cells, port.INTERNAL))
            self._say(f"ended by {words_of(error, internal)}")
            return fault
        return NO_FAULT if peek(servo.block.control, STOP) != 0 else SCHEDULER

    def _last_word(self, servo: Servo, fault: int) -> None:
        # The driver calls no more; the law must know all the same, or the status would go on saying that all is well.
        reading = servo.reading[0]
        reading["trouble"] = fault
        reading["fresh"] = 0
        now_ns, period_s = time.monotonic_ns(), int(servo.plan["period_ns"][0]) * 1e-9
        self._rendering(servo, reading, now_ns, period_s)
        conclude(servo, 0.0, now_ns, period_s)
