"""A cable as a process: frames between a TAP device here and one in another network namespace.

python tap_relay.py NAME /proc/PID/ns/net; then a line `LOST OVERTAKEN` on its input sets the shares of frames that it
loses, and that it holds until the next few have passed. It ends with its input.
"""

import ctypes
import fcntl
import os
import random
import select
import struct
import sys
import time

_TUNSETIFF, _TAP, _NO_INFORMATION = 0x400454CA, 0x0002, 0x1000
_HELD_AT_MOST_S = 0.1
_OVERTAKEN_BY = 12  # frames: more than one strike's datagrams


def tap(name: str) -> int:
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, _TUNSETIFF, struct.pack("16sH", name.encode(), _TAP | _NO_INFORMATION))
    return device


class Way:
    """One direction."""

    def __init__(self, to: int) -> None:
        self._to = to
        self._held: list[tuple[int, float, bytes]] = []  # frames still to pass, latest time, frame
        self._chance = random.Random(1)

    def carry(self, frame: bytes, lost: float, overtaken: float, now: float) -> None:
        draw = self._chance.random()
        if draw < lost:
            return
        if draw < lost + overtaken:
            self._held.append((_OVERTAKEN_BY, now + _HELD_AT_MOST_S, frame))
            return
        self._send(frame)
        self._held = [(left - 1, until, held) for left, until, held in self._held]

    def release(self, now: float) -> None:
        for _, _, frame in (h for h in self._held if h[0] <= 0 or h[1] <= now):
            self._send(frame)
        self._held = [h for h in self._held if h[0] > 0 and h[1] > now]

    def _send(self, frame: bytes) -> None:
        try:
            os.write(self._to, frame)
        except OSError:  # the device is down or full: a frame may be lost at any time
            return


def main() -> None:
    here = tap(sys.argv[1])
    with open(sys.argv[2]) as there:
        if ctypes.CDLL(None, use_errno=True).setns(there.fileno(), 0) != 0:
            raise OSError(ctypes.get_errno(), "setns")
    far = tap("eth0")
    ways = {here: Way(far), far: Way(here)}
    lost = overtaken = 0.0
    print("ready", flush=True)
    while True:
        ready, _, _ = select.select([here, far, sys.stdin], [], [], 0.02)
        now = time.monotonic()
        for device in ready:
            if device is sys.stdin:
                line = sys.stdin.readline()
                if not line:
                    return
                lost, overtaken = map(float, line.split())
            else:
                try:
                    frame = os.read(device, 65536)
                except OSError:  # down, for now
                    time.sleep(0.01)
                    continue
                ways[device].carry(frame, lost, overtaken, now)
        for way in ways.values():
            way.release(now)


if __name__ == "__main__":
    main()
