"""Tortures that a rig works itself: the cable carries, is cut and held; lost strikes and values are counted; a few
rounds on a real rig hold."""

import contextlib
import socket
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from rig_process import PATIENCE_S, wait_for

from drumstick_lab.benchmarks.robustness import torture, torture_harm
from drumstick_lab.benchmarks.robustness.torture_link import Link
from drumstick_lab.benchmarks.robustness.torture_watch import Watch


@pytest.fixture
def echo() -> Iterator[tuple[socket.socket, Link]]:
    with (
        socket.create_server(("127.0.0.1", 0)) as door,
        contextlib.closing(Link(door.getsockname()[1])) as link,
    ):
        yield door, link


def call(door: socket.socket, link: Link) -> tuple[socket.socket, socket.socket]:
    near = socket.create_connection(("127.0.0.1", link.port))
    far, _ = door.accept()
    for end in (near, far):
        end.settimeout(60.0)
    return near, far


def test_the_cable_carries_both_ways_and_ends_when_one_end_does(echo: tuple[socket.socket, Link]) -> None:
    near, far = call(*echo)
    near.sendall(b"to the router")
    assert far.recv(100) == b"to the router"
    far.sendall(b"and back")
    assert near.recv(100) == b"and back"
    far.close()
    assert near.recv(100) == b""
    near.close()


def test_a_cut_cable_tells_both_ends_and_admits_nobody_until_it_is_mended(
    echo: tuple[socket.socket, Link],
) -> None:
    near, far = call(*echo)
    echo[1].cut()
    assert near.recv(100) == b""
    assert far.recv(100) == b""
    near.close()
    far.close()
    with socket.create_connection(("127.0.0.1", echo[1].port)) as turned_away:
        turned_away.settimeout(60.0)
        assert turned_away.recv(100) == b""
    echo[1].mend()
    near, far = call(*echo)
    near.close()
    far.close()


def test_a_held_cable_tells_nobody_and_passes_all_when_it_is_mended(echo: tuple[socket.socket, Link]) -> None:
    near, far = call(*echo)
    echo[1].hold()
    wait_for("the hold", lambda: echo[1].is_still)
    near.sendall(b"late")
    far.settimeout(0.3)
    with pytest.raises(TimeoutError):
        far.recv(100)
    echo[1].mend()
    far.settimeout(60.0)
    assert far.recv(100) == b"late"
    near.close()
    far.close()


def test_a_gap_in_the_strikes_of_one_boot_is_a_loss_and_a_new_boot_is_none() -> None:
    watch = Watch.__new__(Watch)
    heard = [(1, 5), (1, 6), (1, 9), (2, 1), (2, 2), (2, 4)]
    watch.strikes = SimpleNamespace(got=[SimpleNamespace(boot=boot, seq=seq) for boot, seq in heard])  # type: ignore[assignment]
    assert watch.lost() == 3


def test_an_accepted_value_that_is_not_there_is_named() -> None:
    watch = Watch.__new__(Watch)
    watch.accepted = {"k_coll": 3000.0, "tau": 0.005}
    watch.values = lambda: {"k_coll": 2999.0, "tau": 0.005, "dv_pls": 0.1}  # type: ignore[method-assign]
    assert watch.values_lost() == ["k_coll: accepted 3000.0, now 2999.0"]
    assert watch.values_lost() == []


@pytest.mark.real_clock
@pytest.mark.timeout(1800)
@pytest.mark.long
def test_half_a_minute_of_torture_breaks_no_promise(monkeypatch: pytest.MonkeyPatch) -> None:
    """A panic is acted on; how soon, the laboratory says."""
    monkeypatch.setattr(torture, "PANIC_WITHIN_S", PATIENCE_S)
    monkeypatch.setattr(torture, "PANIC_AFTER_A_KILL_S", PATIENCE_S)
    result = torture.empty()
    torture.one_rig(result, 30.0)
    assert result["broken"] == []
    assert result["rounds"] >= 1
    assert result["strikes"]["heard"] > 0
    assert set(result["harms"]) <= set(torture_harm.all_harms(None)) | {"clock jumps"}
