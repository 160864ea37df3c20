"""The Device protocol: the servo's view of a real arm, a simulated one or a recording.

A device owns its loop: `run` paces the ticks, gives the law a reading at each and carries out the force it answers.
"""

from typing import TYPE_CHECKING, NamedTuple, Protocol

from haptic_server.specification import Specification
from realtime.stop import StopRequest

if TYPE_CHECKING:  # the memory of a servo is made for a device, from its specification
    from haptic_server.servo.force.memory import Servo


class Info(NamedTuple):
    """Facts about an open device: its specification, and sentences for a technician."""

    specification: Specification
    words: tuple[str, ...]


class DeviceError(Exception):
    """The device cannot be used; the text says what is wrong and what to do."""


class Device(Protocol):
    """A device as the servo process uses it. Control threads, one at a time; never the tick's.

    The order is open, info, attach_simulation, warm_up, run, close; `close` may follow a failure of any of them, and
    may be called twice.
    """

    def open(self) -> None:
        """Find the device and make it ready, without force. Blocks for seconds; DeviceError when it cannot."""
        ...

    def info(self) -> Info:
        """Facts about the open device. Does not block."""
        ...

    def attach_simulation(self, servo: "Servo") -> "Servo":
        """The servo with what a simulated or replayed device moves in it; a real one leaves it as it is."""
        ...

    def warm_up(self, spare: "Servo") -> None:
        """Compile what `run` needs for servos of this type, before real time starts. Takes seconds; no force.

        `spare` is furnished like the servo to come, with a block that nobody reads.
        """
        ...

    def run(self, servo: "Servo", stop: StopRequest) -> int:
        """Tick until `stop` is asked or the block's STOP cell is set; zero force when it returns.

        Blocks its thread meanwhile. Returns NO_FAULT when asked to stop, else the fault code for which this device
        cannot go on in this process. DeviceError when it cannot begin.
        """
        ...

    def close(self) -> None:
        """Let go of the device: no force and no thread of the driver after this. May block for a second."""
        ...
