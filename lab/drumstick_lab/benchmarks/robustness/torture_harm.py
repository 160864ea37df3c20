"""Faults that a stage meets, each as a context: it begins on entering and is over on leaving."""

import contextlib
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import zenoh
from panel_wire import dial_port
from rig_process import DRUMSTICK, Rig, wait_for
from websockets.sync.connection import Connection

from drumstick_lab.benchmarks.robustness.torture_link import Link
from osc_mutants import MUTANT_HOST, mutant
from unread import fill

SERVO, GATEWAY, SOUND, PANEL = "haptic_server.servo", "haptic_server.gateway", "sound_server", "web_panel"
SERVICES = (SERVO, GATEWAY, SOUND, PANEL)
# A mutant may be a good message, and these would do what they say.
_MEANT = (b"/panic", b"/lease", b"/preset")


class Stage:
    """The rig under torture, and what stands around it.

    session: what listens. flooder: another, since a router that stands may close the link of whoever floods it.
    """

    def __init__(
        self, rig: Rig, session: zenoh.Session, flooder: zenoh.Session, state: Path, link: Link, seed: int
    ) -> None:
        self.rig, self.session, self.flooder, self.state, self.link = rig, session, flooder, state, link
        self.chance = random.Random(seed)

    def pid(self, module: str) -> int:
        """Process id of the service that runs now."""
        return wait_for(module, lambda: self.rig.children().get(module))


Harm = Callable[[Stage], contextlib.AbstractContextManager[None]]


def killed(module: str) -> Harm:
    """SIGKILL; what is started in its place is the supervisor's affair."""

    @contextlib.contextmanager
    def harm(stage: Stage) -> Iterator[None]:
        os.kill(stage.pid(module), signal.SIGKILL)
        yield

    return harm


def stopped(module: str) -> Harm:
    """SIGSTOP for as long as the context is open: a process that gets no processor."""

    @contextlib.contextmanager
    def harm(stage: Stage) -> Iterator[None]:
        pid = stage.pid(module)
        os.kill(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            with contextlib.suppress(ProcessLookupError):  # its supervisor may have had enough of it
                os.kill(pid, signal.SIGCONT)

    return harm


@contextlib.contextmanager
def _beside(work: Callable[[threading.Event], None]) -> Iterator[None]:
    over = threading.Event()
    thread = threading.Thread(target=work, args=(over,))
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@contextlib.contextmanager
def osc_flood(stage: Stage) -> Iterator[None]:
    """Mutated messages, a thousand a second, from another address."""
    chance = random.Random(stage.chance.random())

    def work(over: threading.Event) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.bind((MUTANT_HOST, 0))
            while not over.wait(0.01):
                for _ in range(10):
                    datagram = mutant(chance)
                    if not any(word in datagram for word in _MEANT):
                        udp.sendto(datagram, ("127.0.0.1", stage.rig.osc_in))

    with _beside(work):
        yield


@contextlib.contextmanager
def zenoh_flood(stage: Stage) -> Iterator[None]:
    """Nonsense to the rig's keys and to keys that nobody knows, from a session that does not listen."""
    chance = random.Random(stage.chance.random())
    keys = stage.rig.keys

    def work(over: threading.Event) -> None:
        while not over.wait(0.01):
            for key in (keys.pointer, keys.strike + "/x", keys.state + f"/{chance.randrange(10**6)}"):
                stage.flooder.put(key, chance.randbytes(chance.choice((0, 7, 300, 20000))))
            for key in (keys.set_many, keys.set_one("k_coll"), keys.preset_save, keys.lease):
                stage.flooder.get(
                    key, lambda _reply: None, payload=chance.randbytes(chance.randrange(60)), timeout=0.5
                )

    with _beside(work):
        yield


@contextlib.contextmanager
def unread(stage: Stage) -> Iterator[None]:
    """The supervisor stands still, as after Ctrl-Z, and the gateway's pipe into it is full."""
    stage.rig.process.send_signal(signal.SIGSTOP)
    try:
        fd = os.open(f"/proc/{stage.pid(GATEWAY)}/fd/2", os.O_WRONLY)
        try:
            fill(fd)
        finally:
            os.close(fd)
        yield
    finally:
        stage.rig.process.send_signal(signal.SIGCONT)


def _page_that_is_not_read(stage: Stage) -> Connection:
    # A page's whole connection; what comes is left in the socket.
    address = wait_for("the page", lambda: next((x for x in stage.rig.lines if "panel: http" in x), None))
    port, token = stage.rig.panel_port, address.partition("token=")[2]
    own = f"http://127.0.0.1:{port}"
    return dial_port(port, own, Cookie=f"drumstick_panel_{port}={token}")


@contextlib.contextmanager
def readers_stopped(stage: Stage) -> Iterator[None]:
    """A recorder, a monitor and a page that have begun to read, and read no more."""
    wire = ["--rig", stage.rig.name, "--connect", stage.rig.endpoint]
    with tempfile.TemporaryDirectory(prefix="drumstick-torture-") as folder, contextlib.ExitStack() as stack:
        take = Path(folder) / "take.mcap"
        for words in (["record", "--out", str(take)], ["monitor"]):
            command = [*DRUMSTICK, *words, *wire]
            reader = stack.enter_context(
                subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            )
            stack.callback(reader.kill)
            if words == ["monitor"] and reader.stdout:
                reader.stdout.readline()
            else:
                wait_for("a recording", take.exists)
            reader.send_signal(signal.SIGSTOP)
        page = _page_that_is_not_read(stage)
        stack.callback(page.socket.close)
        yield


@contextlib.contextmanager
def full_disk(stage: Stage) -> Iterator[None]:
    """No byte more fits where the rig keeps its presets and its last set."""
    filler = stage.state / "filler"
    with filler.open("wb", buffering=0) as stream, contextlib.suppress(OSError):
        while True:
            stream.write(bytes(4096))
    try:
        yield
    finally:
        filler.unlink()


@contextlib.contextmanager
def link_cut(stage: Stage) -> Iterator[None]:
    """The cable to the second sound server is pulled, or carries nothing though it is there."""
    (stage.link.cut if stage.chance.random() < 0.5 else stage.link.hold)()
    try:
        yield
    finally:
        stage.link.mend()


@contextlib.contextmanager
def busy(_stage: Stage) -> Iterator[None]:
    """Four programs that never wait, on the rig's processors and at its own priority."""
    turning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(4)]
    try:
        yield
    finally:
        for process in turning:
            process.kill()
            process.wait()


def _write_offset(path: Path, seconds: int) -> None:
    with path.open("r+b") as stream:
        stream.write(struct.pack("@q", seconds))


def clock_jump(offset: Path) -> Harm:
    """The wall clock jumps by up to a day and back: torture_clock.c reads the jump from this file, in place."""

    @contextlib.contextmanager
    def harm(stage: Stage) -> Iterator[None]:
        _write_offset(offset, stage.chance.choice((-86400, -60, 3600, 86400)))
        try:
            yield
        finally:
            _write_offset(offset, 0)

    return harm


def all_harms(offset: Path | None) -> dict[str, Harm]:
    """Every one by its name in the report. offset: the clock's, None: it does not jump."""
    kills = {f"kill {module}": killed(module) for module in SERVICES}
    stops = {f"stop {module}": stopped(module) for module in SERVICES}
    others: dict[str, Harm] = {
        "flood of OSC": osc_flood,
        "flood of Zenoh": zenoh_flood,
        "output unread": unread,
        "disk full": full_disk,
        "link lost": link_cut,
        "machine busy": busy,
        "readers stopped": readers_stopped,
    }
    jumps = {} if offset is None else {"clock jumps": clock_jump(offset)}
    return kills | stops | others | jumps
