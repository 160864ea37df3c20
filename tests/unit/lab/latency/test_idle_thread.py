"""The idle thread's datagrams, and when the kernel took them in."""

from itertools import pairwise

from rig_process import wait_for

from drumstick_lab.benchmarks.latency.arrivals import Arrivals
from drumstick_lab.benchmarks.latency.idle_thread import EVERY, NUMBER, PERIOD_NS, IdleThread


def test_its_datagrams_come_after_their_ticks_and_in_order() -> None:
    with Arrivals() as heard, IdleThread(heard.port) as idle:
        wait_for("three datagrams", lambda: heard.count >= 3)
    due_ns = [NUMBER.unpack(each.payload)[0] for each in heard.got]
    assert len(due_ns) >= 3
    assert all(later - due == EVERY * PERIOD_NS for due, later in pairwise(due_ns))
    # Arrivals are told by another clock, and compared with this one.
    assert all(each.arrival_ns > due - 1_000_000 for each, due in zip(heard.got, due_ns, strict=True))
    assert len(idle.late_ns) > 2 * EVERY
    assert (idle.late_ns >= 0).all()
