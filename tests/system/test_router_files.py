"""The router files of deploy/zenoh, opened by Zenoh itself: who gets what through them, in a venue and between two."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import zenoh
from rig_process import DRUMSTICK, PATIENCE_S, Listener, ask, free_port, wait_for

from made_keys import Keyring
from protocol.access.identity import Identity
from protocol.keys import Keys
from protocol.messages import Readback, State, Strike, decode
from protocol.session import client_config, open_client
from rig.identity.rig_file import load

pytestmark = pytest.mark.system
FILES = Path(__file__).parents[2] / "deploy" / "zenoh"
_NAMES = ("127.0.0.1", "localhost")


class Routers:
    """Routers from the files, at ports of the test's own, and clients of them."""

    def __init__(self, folder: Path, held: ExitStack) -> None:
        self._folder, self._held = folder, held
        self.keyring = Keyring(folder / "keys")
        self._identity = self.keyring.identity("router", _NAMES)
        self.ports = {"192.168.1.5": free_port(), "0.0.0.0": 0, "10.20.0.5": free_port()}

    def config(self, name: str, port: int, identity: Identity | None = None) -> zenoh.Config:
        """Contents of the file, but for its places: this test's keys and loopback ports."""
        own = identity or self._identity
        text = (FILES / name).read_text(encoding="utf-8")
        for said, meant in zip(("ca.pem", "router.pem", "router.key"), own, strict=True):
            text = text.replace(f'"{said}"', f'"{meant}"').replace(
                f'"{said.replace("router", "listener")}"', f'"{meant}"'
            )
        text = text.replace("0.0.0.0:7448", f"127.0.0.1:{port}")
        for address, at in self.ports.items():
            text = text.replace(f"{address}:7448", f"127.0.0.1:{at}")
        path = self._folder / name
        path.write_text(text)
        return zenoh.Config.from_file(path)

    def start(self, name: str, port: int) -> str:
        self._held.enter_context(zenoh.open(self.config(name, port)))
        return f"tls/127.0.0.1:{port}"

    def client(self, end: str, role: str) -> zenoh.Session:
        session = open_client(end, lambda: True, self.keyring.identity(role))
        assert session is not None
        return self._held.enter_context(session)


@pytest.fixture
def routers(tmp_path: Path) -> Iterator[Routers]:
    with ExitStack() as held:
        yield Routers(tmp_path, held)


def answering(session: zenoh.Session, key: str) -> zenoh.Queryable[None]:
    return session.declare_queryable(key, lambda query: query.reply(str(query.key_expr), b"answered"))


def answers(session: zenoh.Session, key: str) -> int:
    return len([reply for reply in session.get(key, timeout=1.0) if reply.ok is not None])


def until_heard(put: Callable[[], None], heard: list[str]) -> None:
    """Put again until the first arrives: a subscription takes a moment to reach the publisher."""

    def arrived() -> bool:
        put()
        return bool(heard)

    wait_for("what was put", arrived)


def hearing(session: zenoh.Session, key: str) -> tuple[list[str], zenoh.Subscriber[None]]:
    heard: list[str] = []
    return heard, session.declare_subscriber(key, lambda sample: heard.append(sample.payload.to_string()))


def test_one_venue_gives_each_certificate_its_role(routers: Routers) -> None:
    end = routers.start("venue.json5", free_port())
    keys = Keys("main")
    haptic, panel, sound = (routers.client(end, name) for name in ("haptic", "panel", "sound"))
    questions = [answering(haptic, keys.set_one("dv_pls")), answering(haptic, keys.scene)]
    heard, listening = hearing(routers.client(end, "listener"), keys.strike)
    until_heard(lambda: haptic.put(keys.strike, "struck"), heard)
    wait_for("an answer to the panel", lambda: answers(panel, keys.set_one("dv_pls")))
    wait_for("an answer to the sound server", lambda: answers(sound, keys.scene))
    assert answers(sound, keys.set_one("dv_pls")) == 0
    for forger in (panel, sound, routers.client(end, "router"), routers.client(end, "stranger")):
        forger.put(keys.strike, "forged")
        assert answers(forger, keys.panic) == 0
    count = len(heard)
    until_heard(lambda: haptic.put(keys.strike, "struck"), heard)
    wait_for("later ones", lambda: haptic.put(keys.strike, "struck") or len(heard) > count)
    assert set(heard) == {"struck"}
    other, listening_too = hearing(panel, Keys("other").strike)
    haptic.put(Keys("other").strike, "not this router's")
    wait_for("an answer", lambda: answers(panel, keys.set_one("dv_pls")))  # after which it would have arrived
    assert other == []
    for each in (*questions, listening, listening_too):
        each.undeclare()


def test_only_chosen_rigs_cross_between_venues(routers: Routers) -> None:
    far = routers.start("south.json5", routers.ports["10.20.0.5"])
    near = routers.start("north.json5", free_port())
    north, rehearsal, south = Keys("north"), Keys("rehearsal"), Keys("south")
    played = {"north": routers.client(near, "haptic"), "south": routers.client(far, "haptic")}
    questions = [answering(played["north"], north.scene), answering(played["north"], north.set_one("m"))]
    at_south, at_north = routers.client(far, "listener"), routers.client(near, "listener")
    crossing, one = hearing(at_south, north.strike)
    staying, two = hearing(at_south, rehearsal.strike)
    back, three = hearing(at_north, south.strike)
    at_home, four = hearing(at_north, north.strike)

    until_heard(lambda: played["north"].put(north.strike, "north"), crossing)
    until_heard(lambda: played["south"].put(south.strike, "south"), back)
    played["north"].put(rehearsal.strike, "rehearsal")
    wait_for("the far scene", lambda: answers(at_south, north.scene))
    # At the other house one may follow, and not set; and nobody there can speak for this house's stick.
    assert answers(routers.client(far, "panel"), north.set_one("m")) == 0
    played["south"].put(north.strike, "forged")
    count = len(back)
    wait_for("what came after", lambda: played["south"].put(south.strike, "south") or len(back) > count)
    until_heard(lambda: played["north"].put(north.strike, "north"), at_home)
    assert staying == []
    assert set(crossing) == set(at_home) == {"north"}
    for each in (*questions, one, two, three, four):
        each.undeclare()


def test_the_browsers_router_comes_in_as_a_listener(routers: Routers) -> None:
    """The wheel opens all of browser.json5 but the plugin, which only zenohd has: what that gets through is shown."""
    end = routers.start("venue.json5", routers.ports["192.168.1.5"])
    keys = Keys("main")
    haptic = routers.client(end, "haptic")
    question = answering(haptic, keys.set_one("dv_pls"))
    with zenoh.open(routers.config("browser.json5", 0, routers.keyring.identity("listener"))) as browser:
        heard, listening = hearing(browser, keys.strike)
        until_heard(lambda: haptic.put(keys.strike, "struck"), heard)
        assert answers(browser, keys.set_one("dv_pls")) == 0
        listening.undeclare()
    question.undeclare()


def test_zenohs_own_websocket_link_opens() -> None:
    """It carries Zenoh's protocol for Zenoh programs; it is not what zenoh-ts in a browser speaks."""
    port = free_port()
    quiet = {"scouting/multicast/enabled": "false"}
    router, client = zenoh.Config(), zenoh.Config()
    for config, settings in (
        (router, {"mode": '"router"', "listen/endpoints": f'["ws/127.0.0.1:{port}"]'}),
        (client, {"mode": '"client"', "connect/endpoints": f'["ws/127.0.0.1:{port}"]'}),
    ):
        for key, value in {**quiet, **settings}.items():
            config.insert_json5(key, value)
    with zenoh.open(router), zenoh.open(client) as session:
        assert [str(link.dst) for link in session.info.links()] == [f"ws/127.0.0.1:{port}"]


@pytest.mark.long
def test_a_rig_plays_by_the_router_that_its_keys_were_made_with(tmp_path: Path, routers: Routers) -> None:
    port, keys = free_port(), Keys("main")
    made = [*DRUMSTICK, "keys", "make", "--out", str(tmp_path / "made"), "--router", "127.0.0.1"]
    subprocess.run(made, check=True, capture_output=True, timeout=PATIENCE_S)
    for path in tmp_path.glob("made/*/rig.toml"):
        text = path.read_text()
        assert 'connect = "tls/127.0.0.1:7448"' in text
        path.write_text(text.replace(":7448", f":{port}"))
    file = tmp_path / "made" / "router" / "router.json5"
    file.write_text(file.read_text().replace("0.0.0.0:7448", f"127.0.0.1:{port}"))
    program = (
        "import sys, zenoh; s = zenoh.open(zenoh.Config.from_file(sys.argv[1])); print('ready', flush=True)"
    )
    haptic = [*DRUMSTICK, "haptic", "--rig-file", "haptic/rig.toml", "--osc-in", str(free_port())]
    folder = tmp_path / "made"
    own = dict(os.environ, XDG_RUNTIME_DIR=str(tmp_path), XDG_STATE_HOME=str(tmp_path))
    with ExitStack() as held:
        router = held.enter_context(
            _process([*DRUMSTICK[:2], program + "; sys.stdin.read(); s.close()", file.name], file.parent, own)
        )
        assert router.stdout is not None
        assert router.stdout.readline() == "ready\n"
        held.enter_context(_process(haptic, folder, own))
        identities = {role: load(folder / role / "rig.toml").identity for role in ("listener", "technician")}
        end = f"tls/127.0.0.1:{port}"
        sessions = {role: zenoh.open(client_config(end, identity)) for role, identity in identities.items()}
        for session in sessions.values():
            held.enter_context(session)
        strikes = Listener(sessions["listener"], keys.strike, Strike)
        states = Listener(sessions["technician"], keys.state, State)
        wait_for("strikes and state", lambda: len(strikes.got) > 5 and len(states.got) > 5)
        assert decode(ask(sessions["technician"], keys.set_one("dv_pls"), 0.25), Readback).value == 0.25


@contextmanager
def _process(
    command: list[str], folder: Path, environment: dict[str, str]
) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=folder, env=environment
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
