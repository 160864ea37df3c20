"""A device that replays positions from a recording: the law answers, nothing moves. For rehearsals and bug reports.

The file is that of servo.simulation.recording; a servo's own trace.csv will do. It is played from its start again
and again. Control thread.
"""

from pathlib import Path

import numpy as np

from drumstick.scenes.recording import MAX_BYTES, Recording, TrajectoryError, recording_of
from haptic_server.servo import loop
from haptic_server.servo.device import paced
from haptic_server.servo.device.protocol import DeviceError, Info
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation.playback import REPLAY
from haptic_server.specification import PREMIUM_1_5
from realtime.regular_file import read_lines
from realtime.stop import StopRequest


def read(path: Path) -> Recording:
    """The recording as rows of t, x, y, z; times rise from 0. DeviceError names file, line and column."""
    try:
        return recording_of(read_lines(path, MAX_BYTES), str(path))
    except TrajectoryError as error:
        raise DeviceError(str(error)) from None
    except OSError as error:
        raise DeviceError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise DeviceError(f"{path}: not a text file; give CSV") from None


class ReplayDevice:
    """The device `replay:FILE`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.recording = np.zeros((2, 4))

    def open(self) -> None:
        """Read the recording."""
        self.recording = read(self._path)

    def info(self) -> Info:
        """Facts as of a PHANTOM, whose guard a rehearsal should meet."""
        seconds = self.recording[-1, 0]
        return Info(
            PREMIUM_1_5,
            (f"replays {self._path}: {len(self.recording)} rows, {seconds:g} s, again and again",),
        )

    def attach_simulation(self, servo: Servo) -> Servo:
        """The servo with what this device moves in it."""
        return servo._replace(replay=np.zeros(1, REPLAY), path=self.recording)

    def warm_up(self, spare: Servo) -> None:
        """Compile the loop and touch every path of it."""
        loop.warm_up(spare)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop."""
        return paced.run(PREMIUM_1_5, servo, stop)

    def close(self) -> None:
        """Do nothing: no resource is held."""
