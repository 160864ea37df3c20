"""Handshakes that are begun and never ended, behind deploy/nftables/drumstick.nft: others still come in."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest
from hosts import Venue, require_root
from rig_process import PATIENCE_S

from haptic_server.access.options import AccessOptions
from made_keys import Keyring
from protocol.access.roles import ROLES
from protocol.session import Public
from realtime.service_options import command

pytestmark = [pytest.mark.system, pytest.mark.needs("nft")]
FILTER = Path(__file__).parents[2] / "deploy" / "nftables" / "drumstick.nft"
HAPTIC, SOUND, WILD = "192.168.1.10", "192.168.1.20", "192.168.1.66"
BEGUN = """
import contextlib, select, socket, sys
tries = []
for _ in range(400):
    each = socket.socket()
    each.setblocking(False)
    each.connect_ex((sys.argv[1], 7448))
    tries.append(each)
print("ready", flush=True)
while tries:
    for each in select.select([], tries, [])[1]:
        with contextlib.suppress(OSError):
            each.sendall(bytes.fromhex("16030102000100"))  # the begin of a ClientHello, and no more
        tries.remove(each)
"""
# Joins when the first handshakes are given up: how many more of them were, until it was in.
JOIN = """
import json, sys
from pathlib import Path
from protocol.access.identity import Identity
from protocol.session import open_client
endpoint, *paths = sys.argv[1:]
def join():
    return open_client(endpoint, lambda: True, Identity(*map(Path, paths)), lambda why: None)
def refused(session):
    while True:
        for reply in session.get("drumstick/r/door", timeout=5.0):
            if reply.ok is not None:
                return json.loads(reply.ok.payload.to_bytes())["handshakes_refused"]
with join() as before:
    first = refused(before)
    print("in", flush=True)
    sys.stdin.readline()
    while (begun := refused(before)) < first + 2:
        pass
    with join() as later:
        print(refused(later) - begun)
"""


@pytest.mark.long
def test_handshakes_that_stand_keep_no_other_machine_out(tmp_path: Path) -> None:
    require_root()
    keyring = Keyring(tmp_path / "keys")
    mine, theirs = keyring.identity("haptic", (HAPTIC,)), keyring.identity("technician")
    venue, started = Venue(), []

    def start(machine: str, *words: str) -> subprocess.Popen[str]:
        entered = [*venue[machine].enter, sys.executable, *words]
        started.append(subprocess.Popen(entered, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        return started[-1]

    try:
        for name, address in (("haptic", HAPTIC), ("sound", SOUND), ("wild", WILD)):
            venue.join(name, address)
        venue["haptic"].run("nft", "-f", str(FILTER))
        public = f"tls/{HAPTIC}:7448"
        options = AccessOptions(public=Public(public, mine, ("r",), tuple(ROLES)))
        start("haptic", *command("haptic_server.access", options)[1:])
        good = start("sound", "-c", JOIN, public, *map(str, theirs))
        assert good.stdout is not None
        assert good.stdout.readline() == "in\n"
        begun = time.monotonic()
        wild = start("wild", "-c", BEGUN, HAPTIC)
        assert wild.stdout is not None
        assert wild.stdout.readline() == "ready\n"
        told, _ = good.communicate("go\n", timeout=PATIENCE_S)
        # Of four hundred: Zenoh gives up ten a second, and the filter lets in ten and two a second.
        assert int(told) <= 10 + 2.0 * (time.monotonic() - begun + 1.0)
    finally:
        for each in started:
            each.kill()
            each.communicate()
        venue.close()
