"""Configurations of Zenoh sessions."""

import json

import pytest
import zenoh

from protocol.session import client_config, router_config

ENDPOINT = "tcp/127.0.0.1:7447"


@pytest.mark.parametrize("config", [router_config(ENDPOINT), client_config(ENDPOINT)])
def test_nobody_waits_for_scouting_that_is_off(config: zenoh.Config) -> None:
    """Zenoh's own default holds up a router's opening by half a second, and so the first strikes of a new gateway."""
    assert json.loads(config.get_json("scouting/delay")) == 0
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("scouting/gossip/enabled")) is False
