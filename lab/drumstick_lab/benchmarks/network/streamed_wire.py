"""Contacts of a scene that streams, as they come over Zenoh: drumstick lab streamed-wire [--contacts 10000] [--speed 1].

A whole rig plays `paper-roll` into nothing, its sound server hears the force, and so does this process, on loopback.
Every contact must come whole: strikes' numbers in a row, ticks in a row to the closing 0 N, and as much impulse as the
release tells. Latency, for each message: from the end of the newest tick in it to its arrival here; for each contact:
from the beginning of its first tick, which is what the sound's delay has to cover. p1, p50 and p99, as measured and
less what witnesses saw the machine stand still; and the gaps that the sound server bridged at the scene's own delay.
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import zenoh
from rig_process import Listener, running, wait_for

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.measuring import stored
from drumstick_lab.soak.quicker import quicker
from haptic_server.servo.stall_detector import StallDetector, without_host_stalls
from protocol.keys import Keys
from protocol.messages import CONTACT_PIECE_S, Contact, Meter, Release, decode

SCENE = "paper-roll"
CONTACTS = 10_000
_IMPULSE = 1e-6  # relative, of a contact: the forces are float32
_IMPULSE_N_S = 1e-9


_STALL_NS = 2_000_000
_BESIDE_NS = 100_000_000  # of a contact's end: a stall so near may have broken it


class Heard(NamedTuple):
    """One message, and when it came, monotonic ns."""

    contact: Contact
    arrival_ns: int


class Ear:
    """Collects the pieces of contacts and the releases of a rig. Zenoh's thread only puts them down."""

    def __init__(self, session: zenoh.Session, keys: Keys) -> None:
        self._pieces: list[tuple[bytes, int]] = []
        self._releases: list[bytes] = []
        self._subscribers = [
            session.declare_subscriber(keys.contact, _on_arrival(self._hear)),
            session.declare_subscriber(keys.release, _on_arrival(self._hear_release)),
        ]

    def _hear(self, sample: zenoh.Sample) -> None:
        self._pieces.append((sample.payload.to_bytes(), time.monotonic_ns()))

    def _hear_release(self, sample: zenoh.Sample) -> None:
        self._releases.append(sample.payload.to_bytes())

    @property
    def count(self) -> int:
        """Contacts that ended after the first whose force came: releases may be held back from before, forces are not."""
        if not (self._pieces and self._releases):
            return 0
        return decode(self._releases[-1], Release).seq - decode(self._pieces[0][0], Contact).seq

    def close(self) -> tuple[list[Heard], list[Release]]:
        """Hear no more; what it heard."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
        heard = [Heard(decode(payload, Contact), at_ns) for payload, at_ns in self._pieces]
        return heard, [decode(payload, Release) for payload in self._releases]


def _on_arrival(take: Callable[[zenoh.Sample], None]) -> Any:
    return zenoh.handlers.Callback(take, indirect=False)


def is_whole(pieces: Sequence[Contact], impulse_N_s: float) -> bool:
    """True when these are all of one contact: ticks in a row, one 0 N at the end, its release's impulse."""
    found = sorted(pieces, key=lambda piece: piece.first_tick)
    forces = [np.frombuffer(piece.forces, "<f4").astype(float) for piece in found]
    following = found[0].first_tick if found else 0
    for piece, means in zip(found, forces, strict=True):
        if piece.first_tick != following:
            return False
        following += len(means)
    together = np.concatenate([*forces, np.zeros(0)])
    if len(together) == 0 or together[-1] != 0.0:
        return False
    off_N_s = abs(together.sum() / found[0].rate_Hz - impulse_N_s)
    return bool(off_N_s <= _IMPULSE_N_S + _IMPULSE * abs(impulse_N_s))


def broken(heard: Iterable[Heard], releases: Sequence[Release]) -> tuple[int, list[int]]:
    """Number of contacts, and the numbers of those that did not come whole, or that no release ended.

    Contacts up to the first that came, and the last, do not count: those may have begun before anybody listened (their
    strikes and releases are held back at a gateway's start, forces are not), and what belongs to that may be on its way.
    """
    impulses = {release.seq: release.impulse_N_s for release in releases}
    own: dict[int, list[Contact]] = {}
    for contact, _ in heard:
        own.setdefault(contact.seq, []).append(contact)
    expected = range(max(min(impulses), min(own, default=0)) + 1, max(impulses))
    wrong = [n for n in expected if n not in impulses or not is_whole(own.get(n, []), impulses[n])]
    return len(expected), wrong


def beside_stalls(
    wrong: Sequence[int], releases: Sequence[Release], stalls: npt.NDArray[np.int64]
) -> list[int]:
    """Broken contacts beside which the machine stood still for longer than a tick or two.

    A servo that gets no processor for twenty ticks has no force to stream, and its gateway drops what is too old.
    """
    long = stalls[stalls[:, 1] - stalls[:, 0] > _STALL_NS]
    ends = {release.seq: release.t_ns for release in releases}
    found: list[int] = []
    for seq in wrong:
        end_ns = ends.get(seq, ends.get(seq + 1, 0))
        if np.any((long[:, 1] > end_ns - _BESIDE_NS) & (long[:, 0] < end_ns + _BESIDE_NS)):
            found.append(seq)
    return found


def _open_ticks(contact: Contact) -> int:
    # Of a piece: the closing 0 N is told at once, and of a tick to come.
    forces = np.frombuffer(contact.forces, "<f4")
    return len(forces) - int(forces[-1] == 0.0)


def _percentiles_ms(
    begun_ns: list[int], arrival_ns: list[int], stalls: npt.NDArray[np.int64]
) -> dict[str, dict[str, float]]:
    begun, took = np.array(begun_ns, np.int64), np.array(arrival_ns, np.int64) - np.array(begun_ns, np.int64)
    result: dict[str, dict[str, float]] = {}
    for name, spent in (("measured", took), ("less_stalls", without_host_stalls(begun, took, stalls))):
        p1, p50, p99 = np.percentile(spent, (1, 50, 99)) / 1e6
        result[name] = {
            "p1_ms": float(p1),
            "p50_ms": float(p50),
            "p99_ms": float(p99),
            "worst_ms": float(spent.max() / 1e6),
        }
    return result


def latencies(heard: Sequence[Heard], stalls: npt.NDArray[np.int64]) -> dict[str, Any]:
    """Percentiles of each message from the end of its newest tick, and of each contact from its first tick's begin."""
    ends: list[int] = []
    firsts: dict[int, tuple[int, int]] = {}
    for contact, at_ns in heard:
        assert contact.t_ns is not None
        ends.append(contact.t_ns + round(_open_ticks(contact) * 1e9 / contact.rate_Hz))
        firsts.setdefault(contact.seq, (contact.t_ns, at_ns))
    begun = list(firsts.values())[1:]
    return {
        "message": _percentiles_ms(ends, [at_ns for _, at_ns in heard], stalls),
        "first_tick": _percentiles_ms([t for t, _ in begun], [at for _, at in begun], stalls),
    }


def played(text: str, contacts: int, patience_s: float) -> dict[str, Any]:
    """A rig of this scene, heard for so many contacts."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "streamed.toml"
        path.write_text(text, encoding="utf-8")
        with running("up", "--scene", str(path), "--audio", "null") as rig:
            session = rig.client()
            meters = Listener(session, rig.keys.meter, Meter)
            wait_for("contacts that sound", lambda: meters.got and meters.got[-1].played > 0)
            before = meters.got[-1]
            with StallDetector() as probes:
                ear = Ear(session, rig.keys)
                wait_for("the contacts", lambda: ear.count >= contacts + 2, patience_s)
                heard, releases = ear.close()
            after = meters.got[-1]
            session.close()
    count, wrong = broken(heard, releases)
    stood_still = beside_stalls(wrong, releases, probes.stalls())
    return {
        "contacts": count,
        "broken": len(wrong) - len(stood_still),
        "broken_beside_stalls": len(stood_still),
        "messages": len(heard),
        "sounded": after.played - before.played,
        "bridged": after.underflows - before.underflows,
        "late": after.late - before.late,
        "latency": latencies(heard, probes.stalls()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--contacts", type=int, default=CONTACTS)
    parser.add_argument("--speed", type=float, default=1.0)
    asked = parser.parse_args()
    text = quicker(shipped_text(SCENE), SCENE, asked.speed)
    patience_s = 60.0 + asked.contacts / (15.0 * asked.speed)
    result: dict[str, Any] = {
        "scene": SCENE,
        "speed": asked.speed,
        "servo_Hz": parse(text, SCENE).servo.rate_Hz,
        "piece_ms": 1e3 * CONTACT_PIECE_S,
    } | played(text, asked.contacts, patience_s)
    print(json.dumps(result, indent=1))
    stored.store("streamed_wire", result)


if __name__ == "__main__":
    main()
