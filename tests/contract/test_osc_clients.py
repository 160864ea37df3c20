"""An independent implementation, liblo's oscdump and oscsend, against the front: what musicians' programs see."""

import queue
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from haptic_server.gateway.osc.osc_server import OscServer
from osc_bench import BOUND_S, RELEASE, STRIKE, Client, FakeParameters, client
from ports import free_port

pytestmark = pytest.mark.needs("oscdump", "oscsend")


class Dump:
    """A running oscdump and the lines it prints."""

    def __init__(self, port: int) -> None:
        self.process = subprocess.Popen(
            ["oscdump", "-L", str(port)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self._lines: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.strip())

    def line(self, wanted: str, timeout_s: float = BOUND_S) -> list[str]:
        """The words of the next line with the address `wanted`, from the address on; queue.Empty after a while."""
        while True:
            words = self._lines.get(timeout=timeout_s).split()
            if wanted in words:
                return words[words.index(wanted) :]

    def is_heard(self, wanted: str) -> bool:
        """True when a line with this address comes within a tenth of a second."""
        try:
            return bool(self.line(wanted, 0.1))
        except queue.Empty:
            return False

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(BOUND_S)
        self._reader.join()
        assert self.process.stdout is not None
        self.process.stdout.close()


def _send(front: OscServer, *words: str) -> None:
    subprocess.run(["oscsend", "127.0.0.1", str(front.endpoint[1]), *words], check=True, timeout=BOUND_S)


@contextmanager
def _rig(parameters: FakeParameters) -> Iterator[tuple[OscServer, Dump]]:
    """A front whose target is an oscdump that is known to listen."""
    port = free_port()
    dump = Dump(port)
    front = OscServer(
        ("127.0.0.1", 0), [("127.0.0.1", port)], "/drumstick", parameters, parameters.load_preset
    )
    try:
        end = time.monotonic() + BOUND_S
        while not dump.is_heard("/drumstick/alive"):
            assert time.monotonic() < end, "oscdump never printed anything"
            front.alive("main", "ready", 0)
        yield front, dump
    finally:
        front.close()
        dump.close()


def test_oscdump_prints_a_strike_and_a_release_with_the_right_types() -> None:
    with _rig(FakeParameters()) as (front, dump):
        front.strike(STRIKE)
        _, types, *values = dump.line("/drumstick/strike")
        assert types == "ifffff"
        assert [float(v) for v in values] == [9, 0.5, -0.25, 1.5, 0.75, 12.5]
        assert dump.line("/drumstick/level") == ["/drumstick/level", "f", "0.750000"]
        assert dump.line("/drumstick/gate") == ["/drumstick/gate", "i", "1"]
        front.release(RELEASE)
        _, types, *values = dump.line("/drumstick/release")
        assert types == "iffff"
        assert [float(v) for v in values] == pytest.approx([9, 1.25, 0.03125, 13.0, 0.0078125], abs=1e-6)
        assert dump.line("/drumstick/gate") == ["/drumstick/gate", "i", "0"]


def test_oscsend_sets_and_asks() -> None:
    parameters = FakeParameters()
    with _rig(parameters) as (front, dump):
        parameters.after_set = front.readback
        _send(front, "/drumstick/param/dv_pls", "f", "0.5")
        assert dump.line("/drumstick/param/dv_pls") == ["/drumstick/param/dv_pls", "f", "0.500000"]
        assert dump.line("/drumstick/param/dv_pls/norm") == ["/drumstick/param/dv_pls/norm", "f", "0.050000"]
        assert parameters.values()["dv_pls"] == 0.5
        parameters.after_set = None
        _send(front, "/drumstick/param/dv_pls")
        assert dump.line("/drumstick/param/dv_pls") == ["/drumstick/param/dv_pls", "f", "0.500000"]
        _send(front, "/drumstick/param/k_coll", "i", "4000")
        _send(front, "/drumstick/param/tau/norm", "d", "0.5")
        _send(front, "/drumstick/sync")
        assert dump.line("/drumstick/param/k_coll") == ["/drumstick/param/k_coll", "f", "4000.000000"]
        assert dump.line("/drumstick/param/tau/norm") == ["/drumstick/param/tau/norm", "f", "0.500000"]


def test_oscsend_is_told_what_is_refused_and_panics() -> None:
    parameters = FakeParameters()
    with _rig(parameters) as (front, dump):
        _send(front, "/drumstick/param/dv_pls", "f", "11")
        words = dump.line("/drumstick/error")
        assert words[:3] == ["/drumstick/error", "ss", '"/drumstick/param/dv_pls"']
        assert "outside 0 .. 10 m/s" in " ".join(words)
        _send(front, "/drumstick/param/dv_pls", "T")
        assert "type T is not read here" in " ".join(dump.line("/drumstick/error"))
        assert parameters.sets == []
        _send(front, "/drumstick/panic")
        assert parameters.panicked.wait(BOUND_S)


def test_oscsend_subscribes_a_second_listener() -> None:
    with _rig(FakeParameters()) as (front, dump):
        second: Client
        with client() as second:
            _send(front, "/drumstick/subscribe", "i", str(second.endpoint[1]))
            _send(front, "/drumstick/ping")
            _send(front, "/drumstick/sync")
            dump.line("/drumstick/param/z_h0/norm")  # so the subscription has been heard
            assert second.next()[0].startswith("/drumstick/param/")
