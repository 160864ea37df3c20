"""Routers that join routers, by the session's own settings and by the files in deploy/zenoh/open: nothing gets lost."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import zenoh
from lone_router import lone_router
from rig_process import free_port, is_subscribed, wait_for

from protocol.session import client_config

FILES = Path(__file__).parents[2] / "deploy" / "zenoh" / "open"
_SCRIPT = """
import sys, zenoh
config = zenoh.Config.from_file(sys.argv[1])
for key, value in zip(sys.argv[2::2], sys.argv[3::2]):
    config.insert_json5(key, value)
session = zenoh.open(config)
print("open", flush=True)
sys.stdin.read()
session.close()
"""
COUNT, OPENING = 200, b"opening"


@contextmanager
def router_of(name: str, listen: str, upstream: str | None = None) -> Iterator[None]:
    """The router of a file in deploy/zenoh/open, at other addresses."""
    words = ["listen/endpoints", json.dumps([listen])]
    words += ["connect/endpoints", json.dumps([upstream])] if upstream is not None else []
    command = [sys.executable, "-c", _SCRIPT, str(FILES / name), *words]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "open\n"
        yield  # its input ends with the block, and with it the process


def heard_across(here: str, there: str, rig: str = "a") -> None:
    """Everything that is put at one router is heard, in order, at the other; and tokens are seen."""
    heard: list[bytes] = []
    with zenoh.open(client_config(there)) as ear, zenoh.open(client_config(here)) as mouth:
        ear.declare_subscriber(
            f"drumstick/{rig}/strike", lambda sample: heard.append(sample.payload.to_bytes())
        )
        publisher = mouth.declare_publisher(f"drumstick/{rig}/strike")
        wait_for("a subscriber across", lambda: is_subscribed(publisher))
        # A router in between may know the subscriber, and not yet the way from here: then it passes nothing on.
        wait_for("the way across", lambda: publisher.put(OPENING) or heard)
        for number in range(COUNT):
            publisher.put(str(number))
        last = str(COUNT - 1).encode()
        wait_for("the last of them", lambda: heard[-1] == last)
        numbers = [payload for payload in heard if payload != OPENING]
        assert numbers == [str(number).encode() for number in range(COUNT)]
        token = mouth.liveliness().declare_token(f"drumstick/{rig}/alive/haptic/1")
        wait_for("the token", lambda: list(ear.liveliness().get(f"drumstick/{rig}/alive/*/*", timeout=1.0)))
        token.undeclare()


def test_a_listener_behind_two_routers_hears_all() -> None:
    with ExitStack() as routers:
        first = routers.enter_context(lone_router())
        second = routers.enter_context(lone_router(first.endpoint))
        third = routers.enter_context(lone_router(second.endpoint))
        heard_across(first.endpoint, third.endpoint)


@pytest.mark.parametrize("first_there", ["venue", "room"])
def test_the_files_for_a_venue_and_a_room_join_whichever_is_there_first(first_there: str) -> None:
    venue, room = (f"tcp/127.0.0.1:{free_port()}" for _ in range(2))
    parts = [("venue-router.json5", venue, None), ("room-router.json5", room, venue)]
    with ExitStack() as routers:
        for part in parts if first_there == "venue" else reversed(parts):
            routers.enter_context(router_of(*part))
        heard_across(venue, room)
        heard_across(room, venue, "b")  # the first one's subscriber may not be forgotten everywhere yet
