"""deploy/nftables/drumstick.nft on a haptic machine: a flood is limited, links stay, OSC is for the allowed."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hosts import Venue, require_root
from rig_process import wait_for

pytestmark = [pytest.mark.system, pytest.mark.needs("nft")]
FILTER = Path(__file__).parents[2] / "deploy" / "nftables" / "drumstick.nft"
HAPTIC, SOUND, STRANGER = "192.168.1.10", "192.168.1.20", "192.168.2.66"

# Answers each line with itself, on every connection; asked for `osc`, it tells who sent to the port of OSC.
LISTENER = """
import selectors, socket
chosen = selectors.DefaultSelector()
door = socket.create_server(("0.0.0.0", 7448), backlog=1000)
osc = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
osc.bind(("0.0.0.0", 9100))
for each in (door, osc):
    chosen.register(each, selectors.EVENT_READ)
heard = []
print("ready", flush=True)
while True:
    for key, _ in chosen.select():
        if key.fileobj is door:
            chosen.register(door.accept()[0], selectors.EVENT_READ)
        elif key.fileobj is osc:
            heard.append(osc.recvfrom(1000)[1][0])
        elif line := key.fileobj.recv(1000):
            key.fileobj.sendall(",".join(heard).encode() if line == b"osc" else line)
        else:
            chosen.unregister(key.fileobj)
            key.fileobj.close()
"""
# A link in place is asked again and again while forty others try to come in at once: how many did, in all answers;
# not before so many have, however long a busy machine takes.
FLOOD = """
import select, socket, sys, time
here, there, wanted = *sys.argv[1:3], int(sys.argv[3])
begun = time.monotonic()
link = socket.create_connection((there, 7448), 60.0)
tries = []
for _ in range(40):
    each = socket.socket()
    each.bind((here, 0))
    each.setblocking(False)
    each.connect_ex((there, 7448))
    tries.append(each)
answers, came = 0, set()
until = time.monotonic() + 0.8  # before a refused one tries again, after a second
while answers < 10 or len(came) < wanted or time.monotonic() < until:
    link.sendall(b"still here?")
    answers += link.recv(1000) == b"still here?"
    came |= set(select.select([], tries, [], 0.02)[1])
print(answers, len(came), time.monotonic() - begun)
"""
SEND = "import socket; s = socket.socket(type=socket.SOCK_DGRAM); s.bind(({0!r}, 0)); s.sendto(b'x', ({1!r}, 9100))"
ASK = """
import socket
with socket.create_connection(("127.0.0.1", 7448)) as link:
    link.sendall(b"osc")
    print(link.recv(10000).decode())
"""


@pytest.fixture(scope="module")
def venue() -> Iterator[Venue]:
    require_root()
    made = Venue()
    listener = None
    try:
        haptic, sound = made.join("haptic", HAPTIC), made.join("sound", SOUND)
        haptic.run("ip", "addr", "add", "192.168.2.10/24", "dev", "eth0")
        sound.run("ip", "addr", "add", f"{STRANGER}/24", "dev", "eth0")
        haptic.run("nft", "-c", "-f", str(FILTER))
        for _ in range(2):  # twice is once
            haptic.run("nft", "-f", str(FILTER))
        listener = subprocess.Popen(
            [*haptic.enter, sys.executable, "-c", LISTENER], stdout=subprocess.PIPE, text=True
        )
        assert listener.stdout is not None
        assert listener.stdout.readline() == "ready\n"
        yield made
    finally:
        if listener is not None and listener.stdout is not None:
            listener.kill()
            listener.wait(10.0)
            listener.stdout.close()
        made.close()


def test_a_flood_of_connections_is_limited_and_a_link_in_place_goes_on(venue: Venue) -> None:
    answers, came, lasted_s = map(
        float, venue["sound"].run(sys.executable, "-c", FLOOD, SOUND, HAPTIC, "5").split()
    )
    assert answers >= 10
    # Of forty: the burst, and two for each second that it took.
    assert came <= 10 + 2.0 * (lasted_s + 1.0)
    listed = venue["haptic"].run("nft", "list", "chain", "inet", "drumstick", "listener")
    dropped = int(re.findall(r"burst 10 packets \} counter packets (\d+)", listed)[0])
    assert dropped >= 40 - came - 1


def test_without_the_filter_all_of_the_flood_comes_in(venue: Venue) -> None:
    venue["haptic"].run("nft", "delete", "table", "inet", "drumstick")
    try:
        _, came, _ = map(float, venue["sound"].run(sys.executable, "-c", FLOOD, SOUND, HAPTIC, "40").split())
    finally:
        venue["haptic"].run("nft", "-f", str(FILTER))
    assert came == 40


def test_a_machine_that_is_not_named_reaches_nothing(venue: Venue) -> None:
    program = (
        f"import socket; s = socket.socket(); s.bind(({STRANGER!r}, 0)); s.settimeout(1.5);"
        " print(s.connect_ex(('192.168.2.10', 7448)))"
    )
    assert venue["sound"].run(sys.executable, "-c", program) != "0\n"


def test_osc_is_heard_from_the_allowed_and_from_loopback_alone(venue: Venue) -> None:
    for machine, own, to in (
        ("sound", STRANGER, "192.168.2.10"), ("sound", SOUND, HAPTIC), ("haptic", "127.0.0.1", "127.0.0.1"),
    ):  # fmt: skip
        venue[machine].run(sys.executable, "-c", SEND.format(own, to))

    def heard() -> list[str]:
        return venue["haptic"].run(sys.executable, "-c", ASK).strip().split(",")

    wait_for("both", lambda: {"127.0.0.1", SOUND} <= set(heard()))
    assert sorted(heard()) == ["127.0.0.1", SOUND]
