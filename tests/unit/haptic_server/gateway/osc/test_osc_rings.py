"""Rigs whose outputs and inputs meet: real parameters on servos in virtual time, real sockets on loopback.

One set goes round once and no further. What is counted are the sets that the rigs hear from each other.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.osc.targets import Endpoint
from haptic_server.gateway.settings import Parameters, ReadbackValue
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from osc_bench import Client, Time, built, client, no_preset

P = "/drumstick"
ROLL = parse(shipped_text("roll"), "roll")
MANY = 200  # messages in one go: it would never end
TICKS = 60  # longer than a stroke: the stick was above the head


class Counting(OscServer):
    """Counts what it hears besides pings, before it acts on it."""

    heard = 0

    def receive(self, datagram: bytes, sender: Endpoint) -> None:
        if not datagram.startswith(b"/drumstick/ping"):
            self.heard += 1
        super().receive(datagram, sender)


class Rig:
    """A gateway's parameters and their OSC front; the test is its relay and its servo's clock."""

    def __init__(self, folder: Path, host: str, now: Time) -> None:
        folder.mkdir()
        self.servo = memory.prepare(ROLL, blocks.create(folder, law_of(ROLL)))
        self.link = ServoLink(folder, law_of(ROLL))
        self.parameters = Parameters(ROLL, self.link)
        self.front = Counting((host, 0), [], P, self.parameters, no_preset, now=now)
        self.port = self.front.endpoint[1]
        self.begun = self.tick = 0

    def subscribe(self, who: Client, port: int) -> None:
        who.udp.sendto(built(P + "/subscribe", port), ("127.0.0.1", self.port))

    @property
    def heard(self) -> int:
        return self.front.heard - self.begun

    def step(self, who: Client) -> list[ReadbackValue]:
        """Everything that has come is acted on, the servo takes what it was offered, and its readback goes out."""
        who.udp.sendto(built(P + "/ping"), ("127.0.0.1", self.port))
        while who.next()[0] != P + "/pong":
            pass
        return self.latch()

    def latch(self) -> list[ReadbackValue]:
        """The servo takes what it was offered, and its readback goes out."""
        self.tick = loop.run_virtual(self.servo, TICKS, self.tick)
        live = self.link.take_live()
        echoes = [] if live is None else self.parameters.latched(*live)
        for echo in echoes:
            self.front.readback(*echo)
        return echoes


@contextmanager
def rigs(folder: Path, count: int, host: str = "127.0.0.1") -> Iterator[tuple[list[Rig], Client]]:
    with ExitStack() as stack:
        now = Time()
        made = [Rig(folder / str(i), host, now) for i in range(count)]
        for rig in made:
            stack.callback(rig.front.close)
        yield made, stack.enter_context(client())


def joined(rigs_: list[Rig], who: Client) -> None:
    """Each sends to the next one, the last to the first."""
    for rig, following in zip(rigs_, rigs_[1:] + rigs_[:1], strict=True):
        rig.subscribe(who, following.port)
    until_quiet(rigs_, who)
    for rig in rigs_:
        rig.begun += rig.heard


def until_quiet(rigs_: list[Rig], who: Client, many: int = MANY) -> int:
    """Number of messages that came until three rounds brought no more; `many` and more: it goes on."""
    quiet, heard = 0, -1
    while quiet < 3 and heard < many:
        for rig in rigs_:
            rig.step(who)
        now = sum(rig.heard for rig in rigs_)
        quiet, heard = (quiet + 1, now) if now == heard else (0, now)
    return heard


@pytest.mark.parametrize(("count", "at_most"), [(2, 4), (3, 16)])
@pytest.mark.parametrize(
    ("name", "value"), [("dv_pls", 0.3), ("k_coll", 5432.1), ("z_h0", -0.0131), ("z_ss", -0.021)]
)
@pytest.mark.parametrize("form", ["", "/norm"])
def test_one_set_goes_round_once(
    tmp_path: Path, count: int, at_most: int, name: str, value: float, form: str
) -> None:
    with rigs(tmp_path, count) as (ring, who):
        joined(ring, who)
        given = value if not form else ring[0].parameters.table[name].norm(value)
        who.udp.sendto(built(f"{P}/param/{name}{form}", given), ("127.0.0.1", ring[0].port))
        values = 1 if name not in ("z_h0", "z_ss") else 3  # z_h0 and z_ss move each other, a rounding more
        assert until_quiet(ring, who) <= 1 + values * at_most
        for rig in ring:
            assert rig.parameters.values()[name] == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("count", [2, 3])
def test_a_set_by_anybody_stays(tmp_path: Path, count: int) -> None:
    with rigs(tmp_path, count) as (ring, who):
        joined(ring, who)
        for i, value in enumerate((0.3, 0.1 + 0.2 / 3.0, 0.25)):
            ring[i % count].parameters.set({"dv_pls": value, "tau": 0.002 + 1e-4 * i}, "zenoh")
            assert until_quiet(ring, who) < MANY
            for rig in ring:
                assert rig.parameters.values()["dv_pls"] == pytest.approx(value, rel=1e-7)
                rig.begun += rig.heard


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("every", [1, 2, 5])
def test_a_fader_that_moves_ends_where_it_was_left(tmp_path: Path, count: int, every: int) -> None:
    # The others send back where it was before, and that comes after its next move: it is no wish of theirs.
    with rigs(tmp_path, count) as (ring, who):
        joined(ring, who)
        for move in range(20):
            who.udp.sendto(built(P + "/param/dv_pls", 0.1 + 0.01 * move), ("127.0.0.1", ring[0].port))
            if move % every == 0:
                for rig in ring[1:]:
                    rig.step(who)
            ring[0].step(who)
        assert until_quiet(ring, who, 10 * MANY) < 5 * MANY
        for rig in ring:
            assert rig.parameters.values()["dv_pls"] == pytest.approx(0.29, rel=1e-6)


def test_two_who_set_at_once_do_not_chase_each_other(tmp_path: Path) -> None:
    with rigs(tmp_path, 2) as (ring, who):
        joined(ring, who)
        for rig, value in zip(ring, (0.3, 0.4), strict=True):
            rig.parameters.set({"dv_pls": value}, "zenoh")
        for rig in ring:  # both have told the other one before they hear it
            rig.latch()
        assert until_quiet(ring, who) < MANY
        ring[0].parameters.set({"dv_pls": 0.25}, "zenoh")
        for rig in ring:
            rig.begun += rig.heard
        assert until_quiet(ring, who) < MANY
        for rig in ring:
            assert rig.parameters.values()["dv_pls"] == pytest.approx(0.25, rel=1e-7)


def test_whoever_goes_back_to_what_he_set_himself_is_heard(tmp_path: Path) -> None:
    with rigs(tmp_path, 1) as ((rig,), who):
        rig.subscribe(who, who.udp.getsockname()[1])
        for value in (0.3, 0.4, 0.3, 0.4, 0.3):
            who.udp.sendto(built(P + "/param/dv_pls", value), ("127.0.0.1", rig.port))
            rig.step(who)
            assert rig.parameters.values()["dv_pls"] == pytest.approx(value, rel=1e-6)


def test_questions_and_sync_go_round_no_further(tmp_path: Path) -> None:
    with rigs(tmp_path, 2) as (ring, who):
        joined(ring, who)
        for question in ("/param/dv_pls", "/sync"):
            who.udp.sendto(built(P + question), ("127.0.0.1", ring[0].port))
            assert until_quiet(ring, who) < MANY
            for rig in ring:
                assert rig.parameters.revision == 0
                rig.begun += rig.heard


def test_it_ends_whoever_unsubscribes_meanwhile(tmp_path: Path) -> None:
    with rigs(tmp_path, 2) as (ring, who):
        joined(ring, who)
        who.udp.sendto(built(P + "/param/dv_pls", 0.3), ("127.0.0.1", ring[0].port))
        ring[0].step(who)
        ring[1].step(who)
        for rig in ring:
            who.udp.sendto(built(P + "/unsubscribe"), ("127.0.0.1", rig.port))
        assert until_quiet(ring, who) <= 20


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_a_rig_that_is_asked_to_send_to_itself_does_not(tmp_path: Path, host: str) -> None:
    with rigs(tmp_path, 1, host) as (alone, who):
        alone[0].subscribe(who, alone[0].port)
        who.udp.sendto(built(P + "/param/dv_pls", 0.3), ("127.0.0.1", alone[0].port))
        assert until_quiet(alone, who) == 2
        assert alone[0].parameters.values()["dv_pls"] == pytest.approx(0.3)


def test_who_sets_every_change_back_beside_osc_ends_too(tmp_path: Path) -> None:
    with rigs(tmp_path, 1) as ((rig,), who):
        rig.parameters.set({"k_hand": 24.0, "m": 0.0151}, "zenoh")
        for _ in range(5):
            for echo in rig.step(who):
                try:
                    rig.parameters.set({echo.name: echo.value}, "zenoh that echoes")
                except Refusal as refusal:
                    raise AssertionError(echo) from refusal
        assert rig.parameters.revision == 1
