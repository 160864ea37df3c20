"""Two million mutated OSC messages against a running rig: drumstick lab osc-fuzz [--messages N] [--seed S].

Stores lab/results/osc_fuzz.json. A real `drumstick haptic` plays; mutants (osc_mutants.py: one to three changes
in a good message, and what killed python-osc's servers) go to its OSC port from another loopback address. After every
hundred a ping must come back: the longest wait is the longest stall, less what witnesses saw the machine stand still.
Memory along the way, lines in the log, restarts. Then the same bytes go to SuperCollider's server, where there is one,
until it answers no more.
"""

import argparse
import json
import random
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder
from rig_process import Rig, ask, running, wait_for

from drumstick_lab.measuring import stored
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls
from osc_mutants import KILLERS, MUTANT_HOST, mutant
from ports import free_port

GROUP = 100
WITHIN_S = 5.0


def built(address: str, *args: int | float) -> bytes:
    builder = OscMessageBuilder(address)
    for arg in args:
        builder.add_arg(arg)
    return builder.build().dgram


def resident_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def packets(seed: int, count: int, killers: Sequence[bytes] = KILLERS) -> Iterator[bytes]:
    """Mutants; each 997th is one of `killers`, if there are any."""
    chance = random.Random(seed)
    for i in range(count):
        yield killers[i // 997 % len(killers)] if killers and i % 997 == 0 else mutant(chance)


def answered(
    udp: socket.socket, where: tuple[str, int], ask_bytes: bytes, address: str, first: object
) -> int:
    """Ask, and how long it took, ns; 0 when no answer came in time."""
    begun = time.monotonic_ns()
    udp.sendto(ask_bytes, where)
    while time.monotonic_ns() - begun < WITHIN_S * 1e9:
        try:
            message = OscMessage(udp.recv(2048))
        except TimeoutError:
            return 0
        if message.address == address and message.params[:1] == [first]:
            return time.monotonic_ns() - begun
    return 0


def attack(rig: Rig, messages: int, seed: int) -> dict[str, object]:
    where = ("127.0.0.1", rig.osc_in)
    gateway = rig.children()["haptic_server.gateway"]
    waits: list[tuple[int, int]] = []
    unanswered = 0
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as honest,
    ):
        stranger.bind((MUTANT_HOST, 0))
        honest.bind(("127.0.0.1", 0))
        honest.settimeout(WITHIN_S)
        warm = resident_mb(gateway)
        memory: list[float] = []
        begun = time.monotonic()
        with StallDetector() as probes:
            for i, packet in enumerate(packets(seed, messages)):
                stranger.sendto(packet, where)
                if i % GROUP == GROUP - 1:
                    at = time.monotonic_ns()
                    took = answered(honest, where, built("/drumstick/ping", i), "/drumstick/pong", i)
                    unanswered += took == 0
                    waits.append((at, took))
                if i % (messages // 20) == 0:
                    memory.append(round(resident_mb(gateway), 1))
        seconds = time.monotonic() - begun
    due, took_ns = np.array(waits, np.int64).T
    own = without_host_stalls(due, took_ns, probes.stalls()) / 1e6
    return {
        "messages": messages,
        "messages_per_s": round(messages / seconds),
        "pings": len(waits),
        "unanswered": int(unanswered),
        "wait_p50_ms": round(float(np.median(own)), 3),
        "wait_p99_ms": round(float(np.percentile(own, 99)), 3),
        "wait_worst_ms": round(float(own.max()), 2),
        "wait_worst_with_the_hosts_stalls_ms": round(float(took_ns.max()) / 1e6, 2),
        "resident_MB": [round(warm, 1), *memory, round(resident_mb(gateway), 1)],
    }


def against_us(messages: int, seed: int) -> dict[str, object]:
    with running("haptic", "--scene", "roll") as rig:
        session = rig.client()
        wait_for("its health", lambda: ask(session, rig.keys.doctor))
        result = attack(rig, messages, seed)
        counted = json.loads(ask(session, rig.keys.doctor))["osc"]
        session.close()
        result["heard"] = counted
        result["lines_in_the_log"] = len(rig.lines)
        rig.stop()
        ended = rig.said
    result["restarts"] = ended.count("restart")
    return result


def against_scsynth(messages: int, seed: int, killers: Sequence[bytes]) -> dict[str, object] | None:
    """Number of the same bytes that SuperCollider's server bears."""
    program = shutil.which("scsynth")
    if program is None:
        return None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        udp.settimeout(2.0)
        return {"program": program, **_bear(program, free_port(), udp, packets(seed, messages, killers))}


def _bear(program: str, port: int, udp: socket.socket, sent: Iterator[bytes]) -> dict[str, object]:
    from drumstick_lab.benchmarks.sound.jack_device import dummy_device

    where = ("127.0.0.1", port)
    with dummy_device(128):
        server = subprocess.Popen(
            [program, "-u", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            for _ in range(40):
                udp.sendto(built("/status", 1), where)
                try:
                    udp.recv(2048)
                    break
                except (TimeoutError, ConnectionRefusedError):
                    time.sleep(0.25)
            else:
                raise RuntimeError("scsynth did not start")
            i = 0
            for i, packet in enumerate(sent):
                udp.sendto(packet, where)
                if ended := _silence(udp, where, server):
                    return {"bore": i, "then": ended, "message": packet.hex()}
            return {"bore": i + 1, "then": "still answers"}
        finally:
            server.kill()
            server.wait()


def _silence(udp: socket.socket, where: tuple[str, int], server: "subprocess.Popen[bytes]") -> str:
    try:
        udp.sendto(built("/status", 1), where)
        while b"/status.reply" not in udp.recv(4096):
            pass
    except (TimeoutError, ConnectionRefusedError) as error:
        time.sleep(0.5)
        status = server.poll()
        return (
            f"ended with status {status}"
            if status is not None
            else f"answers no more ({type(error).__name__})"
        )
    return ""


def main() -> None:
    """Attack, print, store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=2_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dry", action="store_true", help="store nothing")
    given = parser.parse_args()
    result = {
        "seed": given.seed,
        "rig": against_us(given.messages, given.seed),
        "scsynth": against_scsynth(100_000, given.seed, KILLERS),
        "scsynth_mutants_only": against_scsynth(100_000, given.seed, ()),
    }
    print(json.dumps(result, indent=1))
    if not given.dry:
        stored.store("osc_fuzz", result)


if __name__ == "__main__":
    main()
