"""The gateway's part of a streamed force: pieces for whoever subscribes; for nobody, nothing at all is done."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from drumstick.parameters.declare import quantities
from drumstick.parameters.drum import Drum
from drumstick.scenes.scene_text import parse, shipped_text
from haptic_server import contacts as rings
from haptic_server.contacts import LISTENED, SAMPLE, ContactRing
from haptic_server.gateway.zenoh import contacts as gateway
from haptic_server.gateway.zenoh.contact_pieces import Pieces
from haptic_server.gateway.zenoh.contacts import Contacts, contacts_of
from ports import free_port
from protocol.keys import Keys
from protocol.messages import Contact, decode
from protocol.session import open_client, open_router
from realtime import ring
from sound_server.ranges import MAX_DELAY_MS

MS = 1_000_000
KEYS = Keys("streaming")


def samples(seq: int, first: int, forces: list[float]) -> np.ndarray:
    """As a servo at 1 kHz tells them whose tick 0 began at 0 ns."""
    found = np.zeros(len(forces), SAMPLE)
    found["seq"], found["force_N"] = seq, forces
    found["tick"] = first + np.arange(len(forces))
    found["t_ns"], found["x"], found["y"] = found["tick"] * MS, 0.25, -0.5
    return found


def forces_of(piece: Contact) -> list[float]:
    return np.frombuffer(piece.forces, "<f4").tolist()


def told(pieces: Iterator[Contact]) -> list[tuple[int, int, list[float]]]:
    return [(piece.seq, piece.first_tick, forces_of(piece)) for piece in pieces]


def test_a_contact_goes_out_in_pieces_of_two_milliseconds_and_its_end_at_once() -> None:
    pieces = Pieces(1000.0)
    assert told(pieces.of(1, samples(5, 10, [1.0]), 11 * MS)) == []
    assert told(pieces.of(1, samples(5, 11, [2.0, 3.0, 0.0]), 14 * MS)) == [
        (5, 10, [1.0, 2.0]),
        (5, 12, [3.0, 0.0]),
    ]
    assert told(pieces.of(1, samples(6, 20, [4.0, 0.0, 5.0]), 23 * MS)) == [(6, 20, [4.0, 0.0])]
    (piece,) = pieces.of(1, samples(7, 22, [6.0]), 23 * MS)  # another contact: what waited goes first ...
    assert (piece.seq, piece.first_tick, forces_of(piece)) == (6, 22, [5.0])
    (piece,) = pieces.of(1, [], 40 * MS)  # ... and what has waited too long goes by itself
    assert piece == Contact(
        boot=1,
        seq=7,
        first_tick=22,
        rate_Hz=1000.0,
        forces=np.float32([6.0]).tobytes(),
        t_ns=22 * MS,
        x=0.25,
        y=-0.5,
    )


def test_at_a_quicker_rate_a_piece_is_as_long_and_a_gap_ends_it() -> None:
    pieces = Pieces(4000.0)
    found = told(pieces.of(1, samples(1, 0, [1.0] * 10), 10 * MS))
    assert [len(forces) for _, _, forces in found] == [8]
    found = told(pieces.of(1, samples(1, 12, [1.0]), 12 * MS))  # samples 10 and 11 found the ring full
    assert found == [(1, 8, [1.0, 1.0])]


def test_what_waited_for_a_gateway_that_was_away_is_not_sent() -> None:
    pieces = Pieces(1000.0)
    assert told(pieces.of(1, samples(1, 0, [1.0] * 50), 2_000 * MS)) == []
    assert pieces.stale == 50


def test_what_a_scene_and_a_room_of_the_longest_latency_still_play_is_sent_however_late() -> None:
    pieces = Pieces(1000.0)
    longest_ms = 1e3 * quantities(Drum)["latency_s"].high + MAX_DELAY_MS
    found = told(pieces.of(1, samples(1, 0, [1.0] * 50), round(longest_ms) * MS))
    assert sum(len(forces) for _, _, forces in found) == 50
    assert pieces.stale == 0


def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


class Bench:
    """A contact file and its gateway on a real router; the test is the servo, and moves its clock."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.boot, self.now_ns = folder, 7, 10**12
        self.ring = rings.create(folder, self.boot)
        self.endpoint = endpoint()
        self.session = open_router(self.endpoint)
        self.contacts = Contacts(self.session, KEYS.contact, folder, 1000.0, lambda: self.boot)

    def put(self, target: ContactRing, forces: list[float]) -> None:
        for sample in samples(3, self.now_ns // MS, forces):
            ring.push(target.cells, target.slots, sample)

    def step(self) -> None:
        """As the relay does, a millisecond after the last time."""
        self.now_ns += MS
        self.contacts.step(self.now_ns)

    def steps_until(self, what: str, good: Callable[[], bool]) -> None:
        end = time.monotonic() + 60.0
        while not good():
            assert time.monotonic() < end, f"waited in vain for {what}"
            self.step()
            time.sleep(0.001)

    def listened(self, target: ContactRing) -> bool:
        return bool(target.cells[LISTENED])


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.session.close()


def test_nothing_is_computed_or_sent_while_nobody_subscribes(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbidden(*_: object) -> None:
        raise AssertionError("nobody asked for it")

    bench.put(bench.ring, [1.0, 2.0, 0.0])
    for place in ("ring.drain", "messages.encode", "rings.attach"):
        monkeypatch.setattr(f"{gateway.__name__}.{place}", forbidden)
    monkeypatch.setattr(Pieces, "of", forbidden)
    for _ in range(200):
        bench.step()
    assert not bench.listened(bench.ring)
    assert bench.contacts.counters()["put"] == 0


def test_a_subscriber_turns_it_on_and_its_leaving_off(bench: Bench) -> None:
    client = open_client(bench.endpoint, lambda: True)
    assert client is not None
    bench.put(bench.ring, [9.0, 9.0])  # from before: nobody's
    got: list[Contact] = []
    subscriber = client.declare_subscriber(
        KEYS.contact, lambda sample: got.append(decode(sample.payload.to_bytes(), Contact))
    )
    bench.steps_until("the servo to be told", lambda: bench.listened(bench.ring))
    bench.put(bench.ring, [1.0, 2.0, 3.0, 0.0])
    bench.steps_until("two pieces", lambda: len(got) == 2)
    assert [forces_of(piece) for piece in got] == [[1.0, 2.0], [3.0, 0.0]]
    assert got[0].boot == 7
    # A new servo's file is taken up, and a file of an older start is not mistaken for its.
    bench.boot = 8
    bench.steps_until("the old ring to be left", lambda: not bench.listened(bench.ring))
    new = rings.create(bench.folder, 8)
    bench.steps_until("the new ring", lambda: bench.listened(new))
    bench.put(new, [4.0, 0.0])
    bench.steps_until("its piece", lambda: len(got) == 3)
    assert (got[2].boot, forces_of(got[2])) == (8, [4.0, 0.0])
    subscriber.undeclare()
    bench.steps_until("the end of it", lambda: not bench.listened(new))
    client.close()
    assert bench.contacts.counters() == {"wanted": False, "put": 3, "dropped": 0, "stale": 0}


def test_a_file_that_is_none_is_said_once(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    client = open_client(bench.endpoint, lambda: True)
    assert client is not None
    (bench.folder / "contacts.ring").write_bytes(b"x" * 100)
    subscriber = client.declare_subscriber(KEYS.contact, lambda _: None)
    bench.steps_until("the complaint", lambda: len(caplog.records) > 0)
    for _ in range(50):
        bench.step()
    assert len(caplog.records) == 1
    subscriber.undeclare()
    client.close()


def test_a_scene_that_does_not_stream_has_no_publisher(bench: Bench) -> None:
    assert (
        contacts_of(parse(shipped_text("roll"), "roll"), bench.session, KEYS, bench.folder, lambda: 1) is None
    )
