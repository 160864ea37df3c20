"""Effect of an attack on the technician's page on the force: drumstick lab panel-attack [--seconds 20].

The real rig (servo, gateway, sound on a null device, panel). Attackers are a process of their own: connections without
the token, as many as come; frames of a megabyte, each of which ends its connection; 10,000 well-formed messages a
second with the token, all out of range, again and again after each cut; places of a pad, as many as go. Calm windows
before and between. In each window: lateness of the servo's ticks by its own histogram (10 us a bin), and how long an
honest user's set over the same websocket takes until the servo uses it, looked for every 20 ms.
The machine's own stalls are in all windows alike. Then the page that is opened to the network, likewise (`lan_attack`).

--network KIND: only that attack on the page that is opened to the network, ten times on one panel (--times), which tells
a leak from memory that is kept for the next time; nothing is stored.
"""

import argparse
import contextlib
import statistics
import subprocess
import sys
import time
from typing import Any

from panel_wire import Visitor, dial_port
from rig_process import Listener, Rig, running, wait_for
from websockets.exceptions import ConnectionClosed, InvalidStatus

from drumstick_lab.benchmarks.panel import lan_attack
from drumstick_lab.benchmarks.panel.tick_lateness import histogram, lateness
from drumstick_lab.measuring import stored
from protocol.messages import Readback

ATTACKS = ("no token", "megabytes", "messages", "pads")
PER_S = 10_000
SET_EVERY_S = 0.5


def attack(kind: str, port: int, cookie: str) -> None:
    """Attack for ever, in this process."""
    own, end_of_second = f"http://127.0.0.1:{port}", time.monotonic()
    while kind == "no token":
        try:
            dial_port(port, own).close()
        except InvalidStatus:
            continue
    while kind == "megabytes":
        try:
            with dial_port(port, own, Cookie=cookie) as wire:
                while True:
                    wire.send(b"\x00" * 1_000_000)
        except (ConnectionClosed, OSError):
            continue
    while kind == "pads":
        with (
            contextlib.suppress(ConnectionClosed, OSError),
            dial_port(port, own, "/pointer", Cookie=cookie) as wire,
        ):
            while True:
                wire.send("[true,0.5,0.0]")
    while True:
        with contextlib.suppress(ConnectionClosed), dial_port(port, own, Cookie=cookie) as wire:
            visitor = Visitor(wire)
            slider = visitor.find("GuiSliderMessage", "Δv_pls")
            visitor.read_on()
            end_of_second = time.monotonic()
            while True:
                for number in range(PER_S // 100):
                    visitor.update(slider, value=1e9 + number)
                end_of_second += 0.01
                time.sleep(max(0.0, end_of_second - time.monotonic()))


def window(
    session: Any, rig: Rig, honest: Visitor, slider: str, heard: Any, seconds: float
) -> dict[str, Any]:
    bin_us, before = histogram(session, rig)
    took_ms: list[float] = []
    end = time.monotonic() + seconds
    value = 0.2
    while time.monotonic() < end:
        value = 0.2 if value > 0.2 else 0.205
        begun = time.monotonic()
        honest.update(slider, value=value)
        wait_for("the servo's readback", lambda wanted=value: heard.got and heard.got[-1].value == wanted)
        took_ms.append(1e3 * (time.monotonic() - begun))
        time.sleep(max(0.0, SET_EVERY_S - took_ms[-1] / 1e3))
    _, after = histogram(session, rig)
    return {
        "lateness_us": lateness(before, after, bin_us),
        "set_ms": {"p50": statistics.median(took_ms), "max": max(took_ms)},
    }


def measured(seconds: float) -> dict[str, Any]:
    with running("up", "--scene", "roll") as rig:
        session = rig.client()
        printed = wait_for(
            "the panel's address",
            lambda: next((line for line in rig.lines if "?token=" in line), None),
            180.0,
        )
        token = printed.partition("?token=")[2].strip()
        cookie = f"drumstick_panel_{rig.panel_port}={token}"
        heard = Listener(session, rig.keys.param("dv_pls"), Readback)
        rows: list[dict[str, Any]] = []
        with dial_port(rig.panel_port, f"http://127.0.0.1:{rig.panel_port}", Cookie=cookie) as wire:
            honest = Visitor(wire)
            slider = honest.find("GuiSliderMessage", "Δv_pls")
            honest.read_on()
            for kind in ("", *(each for attack_kind in ATTACKS for each in (attack_kind, ""))):
                attacker = (
                    subprocess.Popen(
                        [
                            sys.executable,
                            "-m",
                            "drumstick_lab.benchmarks.panel.panel_attack",
                            "--attack",
                            kind,
                            str(rig.panel_port),
                            cookie,
                        ]
                    )
                    if kind
                    else None
                )
                try:
                    time.sleep(2.0)
                    found = window(session, rig, honest, slider, heard, seconds)
                    assert attacker is None or attacker.poll() is None, "the attacker ended by itself"
                finally:
                    if attacker is not None:
                        attacker.kill()
                        attacker.wait()
                rows.append({"attack": kind or "none", **found})
                print(rows[-1], flush=True)
        assert rig.process.poll() is None
        session.close()
    return {"window_s": seconds, "messages_per_s": PER_S, "rows": rows}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--attack", nargs=3, metavar=("KIND", "PORT", "COOKIE"), help=argparse.SUPPRESS)
    parser.add_argument(
        "--network", choices=lan_attack.KINDS, metavar="KIND", help=", ".join(lan_attack.KINDS)
    )
    parser.add_argument("--times", type=int, default=10)
    given = parser.parse_args()
    if given.attack:
        kind, port, cookie = given.attack
        attack(kind, int(port), cookie)
    if given.network:
        lan_attack.measured((given.network,) * given.times)
        return
    found = {**measured(given.seconds), "network": lan_attack.measured()}
    stored.store("panel_attack", found)


if __name__ == "__main__":
    main()
