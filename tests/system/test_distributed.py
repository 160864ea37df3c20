"""Two real rigs and a sound server under one router: listed, played by pattern, and what one that dies leaves."""

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
import zenoh
from haptic_side import HapticSide, drum
from lone_router import LoneRouter, lone_router
from rig_process import DRUMSTICK, PATIENCE_S, Listener, Rig, free_port, running, wait_for

from protocol.messages import Meter
from protocol.session import client_config
from rig.network.discovery import NO_SERVER, Network

STAGE = f"stage-{os.getpid()}"


class Venue(NamedTuple):
    """Parts that the tests share. `left` is the sound server's own rig, `right` and others came by the pattern."""

    router: LoneRouter
    left: Rig
    right: Rig
    sound: Rig


@pytest.fixture(scope="module")
def venue() -> Iterator[Venue]:
    with (
        lone_router() as router,
        running("haptic", "--connect", router.endpoint, name=f"{STAGE}-left") as left,
        running(
            "sound", "--connect", router.endpoint, "--audio", "null", "--also", f"{STAGE}-*", "--most-rigs", "2",
            name=f"{STAGE}-left",
        ) as sound,
        running("haptic", "--connect", router.endpoint, name=f"{STAGE}-right") as right,
    ):  # fmt: skip
        yield Venue(router, left, right, sound)


@pytest.fixture(scope="module")
def session(venue: Venue) -> Iterator[zenoh.Session]:
    with zenoh.open(client_config(venue.router.endpoint)) as opened:
        yield opened


def rigs(endpoint: str, *options: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [*DRUMSTICK, "rigs", "--connect", endpoint, *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


def listed(endpoint: str) -> dict[str, dict[str, Any]]:
    done = rigs(endpoint, "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["router"] == endpoint
    return {row["rig"]: row for row in told["rigs"]}


def plays(row: dict[str, Any] | None) -> bool:
    """True for the row of a rig that answered, told its state, and is heard; one look may come between them."""
    return row is not None and None not in (row["scene"], row["strikes"], row["round_trip_ms"])


def played(meters: "Listener[Meter]") -> int:
    return meters.got[-1].played if meters.got else 0


@pytest.mark.long
def test_a_rig_that_appears_later_is_listed_and_played(venue: Venue, session: zenoh.Session) -> None:
    left, right = (Listener(session, rig.keys.meter, Meter) for rig in (venue.left, venue.right))
    try:
        wait_for("the sound of both", lambda: played(left) > 5 and played(right) > 5)
    except AssertionError:
        print(played(left), played(right), venue.sound.said, venue.left.said, venue.right.said, sep="\n---\n")
        raise
    names = [venue.left.name, venue.right.name]
    found = wait_for(
        "the rows of both",
        lambda: (
            rows if all(plays((rows := listed(venue.router.endpoint)).get(name)) for name in names) else None
        ),
    )
    for name in names:
        row = found[name]
        assert (row["scene"], row["state"]) == ("roll", "playing")
        assert row["services"] == {"haptic": 1, "sound": 1}
        assert row["strikes"] > 0
        assert row["round_trip_ms"] > 0.0
    table = rigs(venue.router.endpoint).stdout.splitlines()
    assert [line.split()[0] for line in table] == ["rig", *names]


@pytest.mark.long
def test_one_more_than_the_most_is_said_and_one_that_dies_makes_room(
    venue: Venue, session: zenoh.Session
) -> None:
    """The drum that goes fades and the third rig gets its place; the first one's strikes go on being played."""
    third = HapticSide(0, drum(), rig=f"{STAGE}-third", router=session)
    token = session.liveliness().declare_token(third.keys.alive("haptic", "7"))
    wait_for("the words", lambda: f"rig {STAGE}-third came and is not played" in venue.sound.said)
    left = Listener(session, venue.left.keys.meter, Meter)
    wait_for("a meter", lambda: left.got)
    before = left.got[-1]
    for pid in venue.right.children().values():
        os.kill(pid, signal.SIGKILL)
    venue.right.process.kill()
    # Its row is there until its drum has faded, some 10 s: too short for a new process at each look.
    network = Network(session)
    wait_for(
        "nobody's rig",
        lambda: any((seen.rig, seen.state) == (venue.right.name, NO_SERVER) for seen in network.poll()),
    )
    wait_for(
        "the end of its drum", lambda: f"rig {venue.right.name} is gone: its drum fades" in venue.sound.said
    )
    wait_for("the next one", lambda: f"rig {STAGE}-third came: 2 of at most 2 drums" in venue.sound.said)
    third.struck("its strike", lambda m: m.played >= 1)
    wait_for("its row's end", lambda: venue.right.name not in listed(venue.router.endpoint))
    after = left.got[-1]
    assert after.id == before.id
    assert after.played > before.played
    token.undeclare()


@pytest.mark.long
def test_watching_tells_what_comes_and_goes(venue: Venue, session: zenoh.Session) -> None:
    words = [*DRUMSTICK, "rigs", "--connect", venue.router.endpoint, "--watch"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        try:
            assert watching.stdout.readline().startswith("rig ")
            token = session.liveliness().declare_token(f"drumstick/{STAGE}-new/alive/haptic/1")
            lines = iter(watching.stdout.readline, "")
            assert any(f"{STAGE}-new: came: no scene, does not answer; haptic 1" in line for line in lines)
            token.undeclare()
            assert any(f"{STAGE}-new: gone" in line for line in lines)
        finally:
            watching.send_signal(signal.SIGINT)
        assert watching.wait(PATIENCE_S) == 130


@pytest.mark.long
def test_a_router_without_rigs_and_no_router_at_all() -> None:
    with lone_router() as empty:
        none = rigs(empty.endpoint)
        assert (none.returncode, none.stderr) == (0, "")
        assert f"no rig at {empty.endpoint}: the router there answers and knows of none" in none.stdout
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    lost = rigs(endpoint, "--json")
    assert (lost.returncode, lost.stdout) == (3, "")
    assert f"no router answers at {endpoint}" in lost.stderr
