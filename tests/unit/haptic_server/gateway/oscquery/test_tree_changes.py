"""Addresses that come and go with a scene, as a connected client is told of them."""

import dataclasses
import json

from pythonosc.osc_message import OscMessage
from websockets.sync.client import ClientConnection

from osc_bench import BOUND_S, FakeParameters
from oscquery_bench import get, listening, served, told

PATH = "/drumstick/param/dv_pls"


def test_a_client_is_told_which_addresses_another_scene_has_and_hears_on() -> None:
    def commands(client: ClientConnection, count: int) -> list[tuple[str, str]]:
        texts = [json.loads(client.recv(timeout=BOUND_S, decode=True)) for _ in range(count)]
        return sorted((text["COMMAND"], text["DATA"]) for text in texts)

    parameters, other = FakeParameters(), FakeParameters()
    quantity = dataclasses.replace(other.table["k_hand"].quantity, high=7.0)
    other.table["another"] = dataclasses.replace(other.table.pop("dv_pls"), name="another")
    other.table["k_hand"] = dataclasses.replace(other.table["k_hand"], quantity=quantity)
    with (
        served(parameters) as (query, front),
        listening(query.endpoint[1], PATH, "/drumstick/alive") as listener,
    ):
        port = query.endpoint[1]
        query.play_scene(other)  # pyright: ignore[reportArgumentType]
        assert commands(listener, 3) == [
            ("PATH_ADDED", "/drumstick/param/another"),
            ("PATH_CHANGED", "/drumstick/param/k_hand"),
            ("PATH_REMOVED", PATH),
        ]
        assert told(port, "/drumstick/param/k_hand?RANGE")["RANGE"][0]["MAX"] == 7.0
        assert get(port, PATH)[0] == 404
        listener.send(json.dumps({"COMMAND": "LISTEN", "DATA": "/drumstick/param/another"}))
        assert listener.ping().wait(BOUND_S)
        query.play_scene(parameters)  # pyright: ignore[reportArgumentType]
        assert [command for command, _ in commands(listener, 3)] == [
            "PATH_ADDED",
            "PATH_CHANGED",
            "PATH_REMOVED",
        ]
        front.readback("dv_pls", 0.5, 0.25)  # gone meanwhile: nobody listens to it any more
        front.readback("another", 0.5, 0.25)
        front.alive("main", "ready", 4)
        packet = listener.recv(timeout=BOUND_S, decode=False)
        assert OscMessage(packet).address == "/drumstick/alive"
