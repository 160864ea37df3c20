"""The gateway's hold on the servo's block: takes events, readbacks and status; finds a restarted servo again.

All of `take_*`, `status`, `point` and `refresh` belong to the relay thread; `offer` and `raise_panic` may be called by
one other thread at a time (the lock of the parameters sees to that).
"""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.stick.contact_ahead import isolated
from drumstick.stick.law import Records
from haptic_server import block as blocks
from haptic_server.block_header import (
    HEARTBEAT,
    PANIC,
    BlockError,
    Cells,
    is_about_to_tick,
    is_alive,
    is_held,
    raise_panic,
)
from haptic_server.gateway import event_wait
from haptic_server.records import EVENT, POINTER, STATUS, STRIKE, set_type
from realtime import ring, triple_buffer
from realtime.atomics import add_to, peek, poke
from realtime.stop import StopRequest

_log = logging.getLogger("gateway")
_EVENTS_AT_ONCE = 512
DEFAULT_PERIOD_NS = 1_000_000


class ServoLink:
    """A mapped block, replaced when the servo started anew: which is held too where the one before it was."""

    def __init__(self, folder: Path, law: Records, period_ns: int = DEFAULT_PERIOD_NS) -> None:
        """Map the block in `folder`; FileNotFoundError while there is none, BlockError when it is another's.

        period_ns: of the servo's ticks.
        """
        self._folder, self._period_ns = folder, period_ns
        self._wake_cells, self._still_cells = ring.new_cells(), np.zeros(1, np.int64)
        self.force_cells = ring.new_cells()  # of no ring, until one is streamed through
        self._set_type = set_type(law.dtype)
        self._events = np.zeros(_EVENTS_AT_ONCE, EVENT)
        self._timespec = np.zeros(2, np.int64)
        self._status = np.zeros(1, STATUS)
        self._live = np.zeros(1, self._set_type)
        self._offer = np.zeros(1, self._set_type)
        self._pointer = np.zeros(1, POINTER)
        self._attach()

    def _attach(self) -> None:
        self._inode = blocks.inode(self._folder)
        self._still_cells[0] = 0
        self._is_open = False  # by the events taken: a strike has no release yet
        block = blocks.attach(self._folder, self._set_type["law"])
        blocks.claim(block)
        self.block = block  # only now: a set that came between would publish into slots still being claimed

    @property
    def boot(self) -> int:
        """Identifies the servo's start."""
        return self.block.boot

    def is_replaced(self) -> bool:
        """True when another servo has made a block since ours."""
        return blocks.inode(self._folder) not in (0, self._inode)

    def refresh(self) -> bool:
        """Take up a new block if the servo made one; True when it did."""
        if not self.is_replaced():
            return False
        before = self.block.control
        self._attach()
        if is_held(before):  # also where somebody had emptied the run folder meanwhile
            self.raise_panic()
        return True

    def servo_is_alive(self) -> bool:
        """True when the servo ticked within the last tenth of a second."""
        return is_alive(self.block.control)

    def servo_is_about_to_tick(self) -> bool:
        """True when the servo waits with its first tick until somebody hears it."""
        return is_about_to_tick(self.block.header_view)

    def await_events(self, until_ns: int) -> int:
        """Sleep until something waits for the relay, or until then (monotonic); returns how often it looked.

        Something: an event, a set that the servo has taken, a sample in the ring of `force_cells`, a call of `wake`.
        Without the GIL.
        """
        awaited = _awaited(self.block, self.force_cells, self._wake_cells)
        return event_wait.await_events(
            awaited, self._still_cells, self._timespec, self._period_ns, until_ns, self._is_open
        )

    def wake(self) -> None:
        """End `await_events` at its next look. Any thread."""
        poke(self._wake_cells, 0, 1)

    def take_events(self) -> npt.NDArray[np.void]:
        """Strikes and releases not taken yet, oldest first; the array is reused by the next call."""
        count = ring.drain(self.block.ring_cells, self.block.events, self._events)
        if count > 0:
            self._is_open = bool(self._events["kind"][count - 1] == STRIKE)
        return self._events[:count]

    def events_lost(self) -> int:
        """Events that found the ring full, since the servo started."""
        return peek(self.block.ring_cells, ring.DROPPED)

    def take_live(self) -> tuple[int, Records] | None:
        """The set that the servo uses now, if it is one not seen before: revision and law, shape (1,)."""
        if not triple_buffer.read_into(self.block.live_cells, self.block.live, self._live):
            return None
        return self.live()

    def live(self) -> tuple[int, Records]:
        """The set that the servo uses, as last taken."""
        return int(self._live["revision"][0]), self._live["law"].copy()

    def first_live(self) -> tuple[int, Records]:
        """The set in use when the gateway starts."""
        triple_buffer.read_into(self.block.live_cells, self.block.live, self._live)
        return self.live()

    def waiting(self) -> tuple[int, Records] | None:
        """A set that an earlier gateway offered and the servo has not taken yet."""
        between = peek(self.block.wanted_cells, triple_buffer.BETWEEN)
        if between < triple_buffer.FRESH:
            return None
        offered = self.block.wanted[between % triple_buffer.FRESH : between % triple_buffer.FRESH + 1].copy()
        return int(offered["revision"][0]), offered["law"].copy()

    def status(self) -> Any:
        """The servo's latest STATUS record."""
        triple_buffer.read_into(self.block.status_cells, self.block.status, self._status)
        return self._status[0]

    def lateness(self) -> dict[str, object]:
        """Histogram of the ticks' lateness since the servo started, for `doctor`, in bins of 10 us up to the last
        filled one.
        """
        # A copy, since the servo goes on counting: numpy objects to a bin that fills while it looks.
        counts = self.block.lateness.copy()
        filled = np.flatnonzero(counts)
        counts = counts[: filled[-1] + 1 if len(filled) else 0]
        return {"bin_us": blocks.LATENESS_BIN_NS / 1e3, "ticks": [int(count) for count in counts]}

    def lateness_p99_us(self) -> float:
        """The 99th percentile of the ticks' lateness since the servo started, to 10 us."""
        counts: npt.NDArray[np.int64] = np.cumsum(self.block.lateness)
        if counts[-1] == 0:
            return 0.0
        bin_index = int(np.argmax(counts >= 0.99 * counts[-1]))
        return (bin_index + 1) * blocks.LATENESS_BIN_NS / 1e3

    def offer(self, revision: int, law: Records) -> None:
        """Give the servo a whole set; it takes the newest one when the stick is above the head."""
        self._offer["revision"] = revision
        self._offer["law"] = law
        triple_buffer.publish_record(self.block.wanted_cells, self.block.wanted, self._offer[0])

    @property
    def is_pointed(self) -> bool:
        """True when this servo's hand follows a pointer."""
        return self.block.is_pointed

    def point(self, held: bool, lift: float, x: float, y: float) -> None:
        """Tell the servo where the pointer is now. Relay thread."""
        self._pointer["t_ns"] = time.monotonic_ns()
        self._pointer["held"] = held
        self._pointer["lift"], self._pointer["x"], self._pointer["y"] = lift, x, y
        triple_buffer.publish_record(self.block.pointer_cells, self.block.pointer, self._pointer[0])

    def raise_panic(self) -> None:
        """Zero force from the next tick on, also of a servo whose block was not taken up yet."""
        raise_panic(self._folder, self.block.header_view)

    def is_held(self) -> bool:
        """True when a panic or a fault is latched, or a panic is on its way to the next tick."""
        return is_held(self.block.control)


def _awaited(block: blocks.Block, force_cells: Cells, wake_cells: Cells) -> event_wait.Awaited:
    return event_wait.Awaited(
        block.ring_cells, force_cells, block.live_cells, wake_cells, block.status_cells, block.status
    )


def warm_up(law: Records) -> None:
    """Load every compiled function that the gateway calls, on a block of its own: the first strikes come in time."""
    block = blocks.in_memory(law)
    offered = np.zeros(1, set_type(law.dtype))
    offered["law"] = law
    blocks.claim(block)
    ring.drain(block.ring_cells, block.events, np.zeros(1, EVENT))
    cells, timespec = ring.new_cells(), np.zeros(2, np.int64)
    event_wait.await_events(
        _awaited(block, cells, cells), np.zeros(1, np.int64), timespec, DEFAULT_PERIOD_NS, 0, False
    )
    triple_buffer.publish_record(block.wanted_cells, block.wanted, offered[0])
    triple_buffer.publish_record(block.pointer_cells, block.pointer, np.zeros(1, POINTER)[0])
    triple_buffer.read_into(block.live_cells, block.live, offered)
    triple_buffer.read_into(block.status_cells, block.status, np.zeros(1, STATUS))
    add_to(block.control, PANIC, 1)
    peek(block.control, HEARTBEAT)
    isolated(law[0], 1.0)


def wait_for_servo(
    folder: Path,
    law: Records,
    stop: StopRequest,
    report_waiting: Callable[[], None] = lambda: None,
    period_ns: int = DEFAULT_PERIOD_NS,
) -> ServoLink | None:
    """The link to the servo of `folder`, once there is one that ticks or is about to; None when `stop` came first.

    Until then there may be no block (the servo still compiles), or one that an earlier run or version left behind;
    `report_waiting` is called at each look.
    """
    reported = ""
    while not stop.is_set():
        try:
            link = ServoLink(folder, law, period_ns)
            if link.servo_is_alive() or link.servo_is_about_to_tick():
                return link
        except FileNotFoundError:
            reported = ""
        except BlockError as error:
            if str(error) != reported:
                reported = str(error)
                _log.warning("waiting for a servo of this scene: %s", reported)
        report_waiting()
        stop.wait(0.02)
    return None
