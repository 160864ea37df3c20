"""Writes deploy/zenoh/*.json5 from the table of roles: drumstick lab zenoh-routers."""

from pathlib import Path

from drumstick_lab.checkout import ROOT
from protocol.access.identity import Identity
from protocol.access.router import Crossing
from rig.identity.router_file import browser_router, text, venue_router

FOLDER = ROOT / "deploy" / "zenoh"
_MADE = "Made by drumstick lab zenoh-routers from the table of roles; do not edit. docs/network.md tells how to use it."
_OWN = Identity(Path("ca.pem"), Path("router.pem"), Path("router.key"))
_LISTENER = Identity(Path("ca.pem"), Path("listener.pem"), Path("listener.key"))
_HERE = "Start it in the folder of the keys: zenohd -c "


def files() -> dict[str, str]:
    """Name -> what is in it."""
    venue = venue_router(_OWN, ["main"])
    north = venue_router(
        _OWN, ["north", "rehearsal"], far="tls/10.20.0.5:7448", crossing=Crossing(("north",), ("south",))
    )
    south = venue_router(_OWN, ["south"], crossing=Crossing(("south",), ("north",)))
    browser = browser_router("tls/192.168.1.5:7448", _LISTENER, "127.0.0.1:10000")
    return {
        "venue.json5": text(
            [_MADE, f"One venue: everybody comes here, the gateway too. {_HERE}venue.json5"], venue
        ),
        "north.json5": text(
            [
                _MADE,
                "Two venues: this router goes to the other. Of two rigs here `north` crosses, `rehearsal` stays.",
            ],
            north,
        ),
        "south.json5": text([_MADE, "Two venues: this router is gone to. `south` crosses."], south),
        "browser.json5": text(
            [
                _MADE,
                "Zenoh in browsers of this machine: zenohd with the remote-api plugin, as a client with the rights of a",
                "listener. Whoever reaches the websocket has these rights, without a certificate: loopback only.",
            ],
            browser,
        ),
    }


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, words in files().items():
        (FOLDER / name).write_text(words, encoding="utf-8")
