"""A device that another package gives, by its name after --device. Control thread.

`Device` is what its author writes; our own loop paces it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from drumstick import packages
from haptic_server.servo import loop
from haptic_server.servo.device import paced
from haptic_server.servo.device.protocol import DeviceError, Info
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation import device_parts
from haptic_server.specification import Specification
from realtime.kernels.foreign_parts import (
    call_of,
    inner,
    part_function,
    record_of,
    require_arguments,
    source_of,
)
from realtime.records import Record, Rows, dtype_of
from realtime.stop import StopRequest

_ARGUMENTS = {"read": ("state", "reading", "span_s"), "write": ("state", "force_N")}


@dataclass(frozen=True)
class Device:
    """A device of one's own: what the tick reads from it and writes to it, and what it can do at most (docs/extend.md).

    specification: the envelope and the guard reckon with it, so that a number better than the device is a danger to
    whoever holds it. state: what it keeps, a `ds.Record`, 0 at first. read and write are plain functions in Python's
    own text that are compiled into the tick: no allocation, no exceptions, no Python objects. read(state, reading,
    span_s): fill `reading.z_m` (m, up, from the middle of the workspace), `x_m`, `y_m`, and set `reading.fresh` to 1
    where that is new; span_s: time since the last tick. write(state, force_N): the force along z until the next tick;
    the last one of a run is 0. open: finds the device, without force, and returns values of the state, such as
    addresses; it raises whatever says why not. close: lets go. ValueError for what cannot be one.

    >>> import drumstick as ds
    >>> class State(ds.Record):
    ...     z_m: float
    >>> def read(state, reading, span_s):
    ...     state.z_m += 0.01 * span_s
    ...     reading.z_m, reading.fresh = state.z_m, 1
    >>> def write(state, force_N):
    ...     pass
    >>> facts = ds.Specification("lift", (0.1, 0.1, 0.3), 3e-5, 8.5, 1.4, 3500.0, 20.0, range(500, 2001))
    >>> ds.Device(facts, State, read, write).specification.name
    'lift'
    """

    specification: Specification
    state: type[Record]
    read: Callable[..., None]
    write: Callable[..., None]
    open: Callable[[], Mapping[str, float]] = dict
    close: Callable[[], object] = dict

    def __post_init__(self) -> None:
        for what, known in _ARGUMENTS.items():
            require_arguments(getattr(self, what), what, known)
        given, inf = self.specification, math.inf
        lightest_kg, heaviest_kg = given.moving_kg
        for words, fits in {
            "max_force_N must be above 0 and finite": 0.0 < given.max_force_N < inf,
            "resolution_m must be above 0: the smallest step of its positions": 0.0
            < given.resolution_m
            < inf,
            "stiffness_N_per_m must be above 0 and finite": 0.0 < given.stiffness_N_per_m < inf,
            "damping_N_s_per_m must be above 0": given.damping_N_s_per_m > 0.0,
            "workspace_m must be three lengths above 0": all(
                0.0 < length < inf for length in given.workspace_m
            ),
            "rates_Hz must not be empty": len(given.rates_Hz) > 0,
            "moving_kg must be two masses above 0, rising": 0.0 < lightest_kg <= heaviest_kg < inf,
            "grip_N_per_m must be 0 or more": 0.0 <= given.grip_N_per_m < inf,
        }.items():
            if not fits:
                raise ValueError(f"the specification of {given.name}: {words}")


def _part_of(given: Device, name: str) -> ModuleType:
    part, spelt = ModuleType(f"device.{name}"), {"state": f"own.{name}", "reading": "reading"}
    spelt |= {"span_s": "span_s", "force_N": "force_N"}
    for what, arguments in (("read", "own, reading, span_s"), ("write", "own, force_N")):
        function = getattr(given, what)
        text = f"def {what}({arguments}):\n    {call_of(function, spelt)}"
        setattr(part, what, part_function(text, name, {"hook": inner(function)}))
    return part


class OwnDevice:
    """A package's device as the servo uses it (device.protocol); `module`: the one that it is defined in."""

    def __init__(self, given: Device, name: str, module: str) -> None:
        if not name.isidentifier():
            raise DeviceError(f"{name} cannot be the name of a device")
        device_parts.DEVICES[name] = _part_of(given, name)
        self._given, self._name = given, name
        source = source_of(module, (given.read, given.write))
        record = dtype_of(record_of("OwnDevice", {}, given.state, source))
        self._first = np.zeros(1, np.dtype([(name, record)], align=True))

    def open(self) -> None:
        """Find it, as its package does."""
        try:
            values = self._given.open()
            for field, value in values.items():
                self._first[self._name][field] = value
        except Exception as error:  # another's code may raise anything
            raise DeviceError(f"the device {self._name}: {type(error).__name__}: {error}") from error

    def info(self) -> Info:
        """Facts as its package tells them."""
        return Info(
            self._given.specification, (f"{self._given.specification.name}, by an installed package",)
        )

    def initial_state(self) -> Rows[Record]:
        """Its state as it is open, for the tick: shape (1,), a copy."""
        state: Any = self._first.copy()
        return state

    def attach_simulation(self, servo: Servo) -> Servo:
        """The servo with the device's state."""
        return servo._replace(own=self.initial_state())

    def warm_up(self, spare: Servo) -> None:
        """Compile the loop, which ends before its first tick: reading and writing might reach the real device."""
        loop.run_paced(spare, loop.NO_LOG, first_ns=0, most_ticks=0)
        device_parts.release_force(spare.own)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop; the last thing that is written is no force."""
        try:
            return paced.run(self._given.specification, servo, stop)
        finally:
            device_parts.release_force(servo.own)

    def close(self) -> None:
        """Let go, as its package does."""
        self._given.close()


def find(name: str) -> OwnDevice | None:
    """The device of this name from an installed package; None when none has it. DeviceError where that is broken."""
    try:
        found = packages.load(packages.DEVICES, name, Device)
    except packages.PackageError as error:
        raise DeviceError(str(error)) from error
    return None if found is None else OwnDevice(found[0], name, found[1])
