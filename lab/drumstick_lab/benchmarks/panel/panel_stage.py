"""Cost of the stage page on the server's side: drumstick lab panel-stage [--seconds 20] [--rounds 3].

A whole rig plays its roll. The panel's CPU time, children included, is taken from the kernel in windows by turns: nobody
looks, one stage page is open, eight are, and one that takes all beside seven that take nothing. The pages are programs
at the websocket, so that no browser's drawing is on the same processor. Each share is the median of its windows; the
ratio is that of one page to nobody. Also how many frames a second the first page was sent. The goal: 5 % of a core.
"""

import argparse
import contextlib
import re
import socket
import statistics
import threading
import time
from typing import Any

from panel_wire import dial_port
from rig_process import running, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.connection import Connection

from drumstick_lab.benchmarks.panel.panel_cost import cpu_s
from drumstick_lab.measuring import stored
from web_panel.stage.stage_socket import MOST_PAGES
from web_panel.stage.stage_socket import PATH as STATE_PATH

GOAL = 0.05
START_FRAMES, SETTLED_FRAMES, PATIENCE_S = 300, 60, 180.0  # of about 30 a second
READING, DEAD = "reading", "dead"
WINDOWS = {
    "nobody": (),
    "one stage page": (READING,),
    "eight stage pages": (READING,) * MOST_PAGES,
    "one, and seven that take nothing": (READING, *(DEAD,) * (MOST_PAGES - 1)),
}


class StagePage:
    """A stage page without a picture; `frames` counts what it was sent."""

    def __init__(self, port: int, cookie: str, kind: str, to_settle: int = SETTLED_FRAMES) -> None:
        self.frames = 0
        self._settled, self._frames_to_settle = threading.Event(), to_settle
        self._socket: Connection = dial_port(port, f"http://127.0.0.1:{port}", STATE_PATH, Cookie=cookie)
        if kind == READING:
            threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                self._socket.recv()
                self.frames += 1
                if self.frames == self._frames_to_settle:
                    self._settled.set()

    def settle(self) -> None:
        """Wait for the frames that a page gets until its beginning is over. Raises TimeoutError."""
        if not self._settled.wait(PATIENCE_S):
            raise TimeoutError(f"a stage page was sent {self.frames} frames in {PATIENCE_S:g} s")

    def close(self) -> None:
        # Without a farewell: a page that reads nothing would wait for the answer.
        self._socket.socket.shutdown(socket.SHUT_RDWR)


def window(pid: int, port: int, cookie: str, kinds: tuple[str, ...], seconds: float) -> dict[str, float]:
    """Share of a core, and frames a second of the first page."""
    pages = [StagePage(port, cookie, kind) for kind in kinds]
    for page, kind in zip(pages, kinds, strict=True):
        if kind == READING:
            page.settle()
    before, frames, begun = cpu_s(pid), pages[0].frames if pages else 0, time.monotonic()
    time.sleep(seconds)
    spent = time.monotonic() - begun
    found = {"share": (cpu_s(pid) - before) / spent}
    if pages:
        found["frames_per_s"] = (pages[0].frames - frames) / spent
    for page in pages:
        page.close()
    return found


def measured(seconds: float, rounds: int) -> dict[str, Any]:
    """Every window so many times, in turn."""
    found: dict[str, list[dict[str, float]]] = {name: [] for name in WINDOWS}
    with running("up", "--scene", "roll") as rig:
        address = wait_for(
            "the panel's address", lambda: re.search(r"panel: http\S+token=(\S+)", rig.said), 180.0
        )
        cookie = f"drumstick_panel_{rig.panel_port}={address[1]}"
        rig.client().close()  # type: ignore[no-untyped-call]
        pid = rig.children()["web_panel"]
        first = StagePage(rig.panel_port, cookie, READING, START_FRAMES)
        first.settle()
        first.close()
        for _ in range(rounds):
            for name, kinds in WINDOWS.items():
                found[name].append(window(pid, rig.panel_port, cookie, kinds, seconds))
                print(name, found[name][-1], flush=True)
    rows = {
        name: {key: round(statistics.median(each[key] for each in of_one), 4) for key in of_one[0]}
        for name, of_one in found.items()
    }
    one, nobody = rows["one stage page"]["share"], rows["nobody"]["share"]
    return {
        "window_s": seconds,
        "rounds": rounds,
        "goal": GOAL,
        "rows": rows,
        "ratio": round(one / nobody, 2),
    }


def main() -> None:
    """Measure, tell and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    found = measured(given.seconds, given.rounds)
    one = found["rows"]["one stage page"]["share"]
    print(f"one stage page: {one:.1%} of a core, {found['ratio']:g} times that of nobody")
    if one > GOAL:
        print(f"above the goal of {GOAL:.0%}")
    stored.store("panel_stage", found)


if __name__ == "__main__":
    main()
