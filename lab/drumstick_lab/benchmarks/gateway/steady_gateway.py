"""The gateway as it was: it looks for events every 150 us, whatever the stick does, and makes a round every 2 ms.

python -m drumstick_lab.benchmarks.gateway.steady_gateway OPTIONS, as of haptic_server.gateway.
"""

import sys

import numpy as np
import numpy.typing as npt

from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.process import main
from haptic_server.gateway.relay import Relay
from realtime import ring
from realtime.atomics import load_acquire
from realtime.clock import now_ns, sleep_until
from realtime.kernels.jit import njit

PERIOD_NS = 150_000
ROUND_NS = 2_000_000
Cells = npt.NDArray[np.int64]


@njit()
def await_written(cells: Cells, timespec: Cells, period_ns: int, until_ns: int) -> int:
    """Sleep until the ring has something, looking every period_ns, or until until_ns; returns how often it looked."""
    looks = 0
    now = now_ns(timespec)
    while load_acquire(cells, ring.WRITTEN) == cells[ring.READ] and now < until_ns:
        sleep_until(timespec, min(now + period_ns, until_ns))
        now = now_ns(timespec)
        looks += 1
    return looks


def look_steadily() -> None:
    """Replace the wait of this process's gateway."""
    timespec = np.zeros(2, np.int64)
    await_written(ring.new_cells(), timespec, PERIOD_NS, 0)  # compiled before the first event

    def await_events(link: ServoLink, until_ns: int) -> int:
        return await_written(link.block.ring_cells, timespec, PERIOD_NS, until_ns)

    def next_round_ns(_relay: Relay, now: int) -> int:
        return now + ROUND_NS

    ServoLink.await_events = await_events
    Relay.next_round_ns = next_round_ns


if __name__ == "__main__":
    look_steadily()
    sys.exit(main())
