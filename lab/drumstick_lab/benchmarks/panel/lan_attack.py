"""Attacks on the page that is opened to the network (--panel-lan), over TLS: a part of drumstick lab panel-attack.

The real rig, opened at another address of loopback. For each attack an attacker of its own, a process that ends by itself
after 30 s: from one address, or from eight (four take all 64 places). An honest
visitor at 127.0.0.3, who has logged in, presses PANIC by turns on a page that he had open and on one that he dials
anew, tried every 20 ms until there is a place; each time the rig is armed again. What the panel's process has of memory,
threads and descriptors is read before, at its most and when its descriptors are as many as before.
"""

import contextlib
import io
import itertools
import multiprocessing
import re
import socket
import ssl
import statistics
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from lan_page import HOST, LanPage
from panel_wire import Visitor
from rig_process import Listener, Rig, ask, running, wait_for
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from drumstick_lab.benchmarks.panel.tick_lateness import histogram, lateness
from ports import free_port
from protocol.messages import State
from rig.supervision.arm import arm
from tls_wire import TlsWire
from web_panel.access.lan_listener import OF_ONE

HONEST = "127.0.0.3"
ONE, EIGHT = ("127.0.0.10",), tuple(f"127.0.0.{10 + i}" for i in range(8))
WINDOW_S, _SETTLE_S, _PATIENCE_S, _BOUND_S = 5.0, 1.0, 60.0, 30.0
_REFUSED = (OSError, InvalidHandshake, ConnectionClosed)  # errors of TLS are OSErrors
_EMPTY_PIECES = b"\x00\x80\0\0\0\0" * 700


def _held(sources: tuple[str, ...], begin: Callable[[str], Any], drip: bytes = b"") -> None:
    """All places that these addresses get, and again when they are ended; `drip`: a byte of it each now and then."""
    mine: dict[tuple[str, int], Any] = {}
    letters = itertools.cycle(drip or b"\0")
    while True:
        for place in itertools.product(sources, range(OF_ONE)):
            try:
                if place not in mine:
                    mine[place] = begin(place[0])
                elif drip:
                    mine[place].sendall(bytes([next(letters)]))
                else:
                    mine[place].setblocking(False)
                    if not mine[place].recv(1):
                        mine.pop(place).close()
            except (BlockingIOError, ssl.SSLWantReadError):
                continue
            except OSError:
                if place in mine:
                    mine.pop(place).close()
        time.sleep(0.01)


def _begun(page: LanPage, source: str) -> socket.socket:
    connection = page.tcp(source)
    connection.sendall(bytes.fromhex("16030102000100"))  # the begin of a ClientHello, and no more
    return connection


def _begun_request(page: LanPage, source: str) -> ssl.SSLSocket:
    connection = page.shaken(source)
    connection.sendall(f"GET / HTTP/1.1\r\nHost: {page.place}\r\nX-Slow: ".encode())
    return connection


def _plain(page: LanPage, source: str) -> None:
    with page.tcp(source) as connection:
        connection.sendall(f"GET / HTTP/1.1\r\nHost: {page.place}\r\n\r\n".encode())
        while connection.recv(1000):
            pass


def _by_websocket(page: LanPage, cookie: str, speak: Callable[[TlsWire], None]) -> None:
    with page.dial_once(page.origin, ONE[0], {"Cookie": cookie}) as wire:
        while True:
            speak(wire)


def _pour(wire: TlsWire) -> None:
    visitor = Visitor(wire)
    slider = visitor.find("GuiSliderMessage", "Δv_pls")
    end_s = time.monotonic()
    while True:
        for number in range(100):  # 10,000 a second
            visitor.update(slider, value=1e9 + number)
        end_s += 0.01
        time.sleep(max(0.0, end_s - time.monotonic()))


def _endless(page: LanPage, cookie: str) -> None:
    with page.websocket(cookie, ONE[0]) as connection:
        connection.sendall(b"\x02\x80\0\0\0\0")
        while True:
            connection.sendall(_EMPTY_PIECES)


def attacks(page: LanPage, cookie: str, used: str) -> dict[str, tuple[int, Callable[[], object]]]:
    """From how many addresses, and one round of each attack, which is repeated. `used`: paths of a used login link."""
    paths = itertools.cycle((used, "/?login=wrong", "/?token=wrong"))

    def get(path: str, **headers: str) -> int:
        return page.get_once(path, ONE[0], headers)[0]

    foreign = itertools.cycle(({"Origin": "https://evil.example"}, {"Host": "evil.example"}))
    return {
        "connections that say nothing": (1, lambda: _held(ONE, page.tcp)),
        "the same, from eight addresses": (8, lambda: _held(EIGHT, page.tcp)),
        "handshakes that are begun": (1, lambda: _held(ONE, lambda at: _begun(page, at))),
        "handshakes from eight addresses": (8, lambda: _held(EIGHT, lambda at: _begun(page, at))),
        "requests of a byte now and then": (1, lambda: _held(ONE, lambda at: _begun_request(page, at), b"a")),
        "plain HTTP": (1, lambda: _plain(page, ONE[0])),
        "login links that are used or wrong": (1, lambda: get(next(paths))),
        "no cookie": (1, lambda: get("/")),
        "another Origin or Host": (1, lambda: get("/", Cookie=cookie, **next(foreign))),
        "frames of a megabyte": (1, lambda: _by_websocket(page, cookie, lambda wire: wire.send(bytes(1_000_000)))),
        "10,000 messages a second": (1, lambda: _by_websocket(page, cookie, _pour)),
        "a message that never ends": (1, lambda: _endless(page, cookie)),
    }  # fmt: skip


def attack(page: LanPage, cookie: str, used: str, kind: str) -> None:
    """Repeat it, for 30 s at most. In a process of its own."""
    threading.Timer(_BOUND_S, lambda: multiprocessing.current_process().kill()).start()
    _, once = attacks(page, cookie, used)[kind]
    while True:
        with contextlib.suppress(*_REFUSED):
            once()


def usage(pid: int) -> dict[str, float]:
    """Resident memory, MB, threads and descriptors of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    found = dict(line.split(":\t") for line in lines if line.startswith(("VmRSS", "Threads")))
    return {
        "MB": int(found["VmRSS"].split()[0]) / 1e3,
        "threads": int(found["Threads"]),
        "descriptors": len(list(Path(f"/proc/{pid}/fd").iterdir())),
    }


class Honest:
    """Visitor who has logged in, and presses PANIC."""

    def __init__(self, page: LanPage, cookie: str, rig: Rig, states: Any) -> None:
        self._page, self._headers, self._rig, self._states = page, {"Cookie": cookie}, rig, states
        self.open = page.dial(page.origin, HONEST, **self._headers)
        self.button = Visitor(self.open).find("GuiButtonMessage", "PANIC")
        Visitor(self.open).read_on()
        self.refused = 0

    def press(self, anew: bool) -> float:
        """Milliseconds until the servo says that it has heard; then the rig is armed."""
        begun = time.monotonic()
        wire = self._dialled() if anew else self.open
        try:
            Visitor(wire).update(self.button, value=True)
            wait_for("the panic", lambda: self._states.got[-1].status == "panic")
            took_ms = 1e3 * (time.monotonic() - begun)
        finally:
            if anew:
                wire.close()
        with contextlib.redirect_stdout(io.StringIO()):
            arm(self._rig.name)
        wait_for("an armed rig", lambda: self._states.got[-1].status != "panic")
        return took_ms

    def _dialled(self) -> TlsWire:
        until = time.monotonic() + _PATIENCE_S
        while True:
            try:
                return self._page.dial_once(self._page.origin, HONEST, self._headers)
            except _REFUSED:
                self.refused += 1
                if time.monotonic() > until:
                    raise
                time.sleep(0.02)


def window(session: Any, rig: Rig, honest: Honest, states: Any) -> dict[str, Any]:
    """Pressing for five seconds, and what it met."""
    pid = rig.children()["web_panel"]
    (bin_us, before), overruns, refused = histogram(session, rig), states.got[-1].overruns, honest.refused
    took: dict[bool, list[float]] = {False: [], True: []}
    most, gateway_ms = usage(pid), list[float]()
    end_s = time.monotonic() + WINDOW_S
    while time.monotonic() < end_s or not took[True]:
        for anew in took:
            took[anew].append(honest.press(anew))
            begun = time.monotonic()
            ask(session, rig.keys.clock)
            gateway_ms.append(1e3 * (time.monotonic() - begun))
            now = usage(pid)
            most = {name: max(value, now[name]) for name, value in most.items()}
    return {
        "lateness_us": lateness(before, histogram(session, rig)[1], bin_us),
        "overruns": states.got[-1].overruns - overruns,
        "gateway_ms": max(gateway_ms),
        "open_ms": {"p50": statistics.median(took[False]), "max": max(took[False])},
        "dialled_ms": {"p50": statistics.median(took[True]), "max": max(took[True])},
        "refused": honest.refused - refused,
        "pressed": 2 * len(took[True]),
        "most": most,
    }


KINDS = tuple(attacks(LanPage(0, Path(), 0, ""), "", ""))


def measured(kinds: Sequence[str] = ("", *KINDS, "")) -> dict[str, Any]:
    """Rows of these attacks on one panel; "" is a calm window."""
    port = free_port()
    rows: list[dict[str, Any]] = []
    with running("up", "--scene", "roll", "--panel-lan-at", f"{HOST}:{port}") as rig:
        session = rig.client()
        found = wait_for(
            "the login link", lambda: re.search(r"(\?token=\S+)[\s\S]*(/\?login=\S+)", rig.said), 180.0
        )
        near = f"drumstick_panel_{rig.panel_port}={found[1].removeprefix('?token=')}"
        page = LanPage(
            port, rig.state / "drumstick" / rig.name / "panel-lan" / "panel.pem", rig.panel_port, near
        )
        states = Listener(session, rig.keys.state, State)
        wait_for("a state", lambda: states.got)
        honest = Honest(page, page.get(found[2], HONEST)[1], rig, states)
        used = page.word()
        cookie = page.get(used, ONE[0])[1]
        pid = rig.children()["web_panel"]
        for kind in kinds:
            time.sleep(_SETTLE_S)
            before = usage(pid)
            attacker = multiprocessing.get_context("spawn").Process(
                target=attack, args=(page, cookie, used, kind)
            )
            if kind:
                attacker.start()
            try:
                time.sleep(_SETTLE_S)
                row = window(session, rig, honest, states)
                assert not kind or attacker.is_alive(), "the attacker ended by itself"
            finally:
                if kind:
                    attacker.kill()
                    attacker.join()
            ended_s = time.monotonic()
            wait_for("its descriptors", lambda most=before: usage(pid)["descriptors"] <= most["descriptors"])
            back = {"back_s": time.monotonic() - ended_s, "before": before, "after": usage(pid)}
            rows.append({"attack": kind or "none", **row, **back})
            print(rows[-1], flush=True)
        assert rig.process.poll() is None
        honest.open.close()
        session.close()
    return {"window_s": WINDOW_S, "rows": rows}
