"""Conformance of a device of one's own, for one that is simulated or stands in for a real one: it is played as fast as
the machine can, without a clock.
"""

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.envelope import OutOfEnvelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick.testing.rules import NotConforming, compiled_rules, declared, require_no_allocation
from haptic_server import block
from haptic_server.limits import limits_of
from haptic_server.records import FAULT_WORDS, NO_FAULT, READING, Reading
from haptic_server.servo import loop
from haptic_server.servo.device.own_device import Device, OwnDevice, find
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.force import memory
from haptic_server.servo.simulation import device_parts
from realtime.kernels.jit import njit
from realtime.records import Record, Rows

_TICKS = 4000
_COARSER = 1.5  # times the declared step of positions, so that a few missing counts do not count


@njit()
def _read(
    own: Rows[Record], reading: Reading, span_s: float, out: npt.NDArray[np.float64], force_N: float
) -> None:
    # out: shape (n, 2), each tick's position and whether it was new. The force is pushed and pulled by turns.
    for tick in range(out.shape[0]):
        device_parts.measure(own[0], reading, tick, span_s)
        out[tick, 0], out[tick, 1] = reading.z_m, reading.fresh
        device_parts.write(own[0], force_N if tick % 200 < 100 else -force_N)


class _Played:
    """Positions of a device that is read for some seconds, without and with force."""

    def __init__(self, name: str, device: OwnDevice) -> None:
        self.name, self._device = name, device
        self._specification = device.info().specification

    def refuse(self, rule: str, words: str) -> None:
        raise NotConforming(self.name, rule, words)

    def read(self, force_N: float, ticks: int = _TICKS) -> npt.NDArray[np.float64]:
        out, reading = np.zeros((ticks, 2)), np.zeros(1, READING)
        period_s = 1.0 / self._specification.rates_Hz[len(self._specification.rates_Hz) // 2]
        with compiled_rules(self.name):
            _read(self._device.initial_state(), reading[0], period_s, out, force_N)
        return out

    def positions(self, force_N: float) -> None:
        read = self.read(force_N)
        if not np.isfinite(read[:, 0]).all():
            self.refuse("finite", "a position is no finite number, or was left out")
        if not read[:, 1].any():
            self.refuse("fresh", "no reading was ever marked as new: set reading.fresh = 1")
        reach_m = 0.5 * self._specification.workspace_m[2]
        if (farthest := float(np.abs(read[:, 0]).max())) > reach_m:
            self.refuse(
                "range", f"a position of {farthest:.4g} m, declared +-{reach_m:.4g} m (half the workspace)"
            )
        steps = np.diff(np.unique(read[:, 0]))
        if steps.size and steps.min() > _COARSER * self._specification.resolution_m:
            declared_m = self._specification.resolution_m
            self.refuse(
                "resolution", f"positions come in steps of {steps.min():.3g} m, declared {declared_m:.3g} m"
            )
        if self.read(force_N).tobytes() != read.tobytes():
            self.refuse("deterministic", "read again from the same state, it is elsewhere")

    def plays(self, scene: Scene) -> None:
        specification = self._specification
        try:
            envelope.require(law_of(scene), limits_of(scene, specification))
        except OutOfEnvelope as refusal:
            self.refuse("envelope", f"it may not play {scene.name}: {refusal}")
        own = block.in_memory(law_of(scene))
        servo = self._device.attach_simulation(memory.prepare(scene, own, specification=specification))
        clock_ns = [0]

        def play(ticks: int) -> None:
            clock_ns[0] = loop.run_virtual(servo, ticks, clock_ns[0])

        require_no_allocation(self.name, lambda: play(1), lambda: play(_TICKS))
        if (fault := int(servo.tick_state[0]["fault"])) != NO_FAULT:
            self.refuse("plays", f"{scene.name} ended in a fault: {FAULT_WORDS[fault]}")


def check_device(name: str, device: Device | None = None, *, scene: Scene | None = None) -> None:
    """Play a device, and judge it by what it declares; NotConforming says which rule it breaks.

    name: as after --device. device: one that is not installed yet. scene: one that it should play; the shipped
    `phantom` if not given. The rules: it opens, compiles, allocates and raises nothing; its positions are finite, new,
    within its workspace and as fine as it declares, the same again from the same state; the scene plays on it without a
    fault. It is given forces up to a quarter of its largest: a real arm must be replaced by a stand-in.

    >>> import drumstick as ds
    >>> from drumstick import testing
    >>> class State(ds.Record):
    ...     z_m: float
    >>> def read(state, reading, span_s):
    ...     state.z_m += 0.1 * span_s  # up, for ever
    ...     reading.z_m, reading.fresh = state.z_m, 1
    >>> def write(state, force_N):
    ...     pass
    >>> facts = ds.Specification("lift", (0.1, 0.1, 0.3), 3e-4, 8.5, 1.4, 3500.0, 20.0, range(500, 2001))
    >>> testing.check_device("lift", ds.Device(facts, State, read, write))
    Traceback (most recent call last):
        ...
    drumstick.testing.rules.NotConforming: lift: range: a position of ... m, declared +-0.15 m (half the workspace)
    """
    with declared(name):
        try:
            made = find(name) if device is None else OwnDevice(device, name, device.read.__module__)
            if made is None:
                raise ValueError("no installed package has a device of that name")
            made.open()
        except DeviceError as error:
            raise ValueError(str(error)) from error
    try:
        played = _Played(name, made)
        played.read(0.0)
        require_no_allocation(name, lambda: played.read(0.0, 1), lambda: played.read(0.0))
        for force_N in (0.0, 0.25 * made.info().specification.max_force_N):
            played.positions(force_N)
        played.plays(parse(shipped_text("phantom"), "phantom") if scene is None else scene)
    finally:
        made.close()
