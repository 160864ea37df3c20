"""Glide of the pitch and places of pickups, set by OSC and by Zenoh while a whole rig is played: everybody says so."""

from collections.abc import Iterator

import pytest
import zenoh
from osc_port import OscPort
from rig_process import Listener, Rig, ask, wait_for
from wav_heard import heard_in

from protocol.messages import Meter, Readback, decode

SCENE = """
[stick]
z_ss_m = 0.05
[drum.effects.tension]
glide_cents = 60
[listen]
pickups = [[0.5, 0.6, 0.0]]
pickup_places = "live"
"""


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with heard_in(tmp_path_factory.mktemp("sound") / "heard.wav", SCENE) as started:
        yield started


def test_a_glide_is_set_and_one_that_the_scene_does_not_follow_is_refused(
    rig: Rig, session: zenoh.Session, osc: OscPort
) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    osc.send("/drumstick/param/tension.glide", 256.0)
    assert osc.receive("/drumstick/param/tension.glide", 256.0)
    told = decode(ask(session, rig.keys.param("tension.glide")), Readback)
    assert (told.value, told.pending) == (256.0, False)
    told = decode(ask(session, rig.keys.set_one("tension.glide"), 128.0), Readback)
    assert osc.receive("/drumstick/param/tension.glide", 128.0)
    osc.send("/drumstick/play/strike", 0.5, 0.0, 1.0)
    wait_for("a drum that glides so", lambda: meters.got and meters.got[-1].revision >= told.revision)
    assert meters.got[-1].waiting == ""
    osc.send("/drumstick/param/tension.young", 5.0)
    assert "/drumstick/param/tension.young" in map(str, osc.receive("/drumstick/error"))


def test_a_pickup_is_moved_by_osc_and_not_beyond_the_rim(
    rig: Rig, session: zenoh.Session, osc: OscPort
) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    osc.send("/drumstick/param/pickup-1.x", 0.25)
    assert osc.receive("/drumstick/param/pickup-1.x", 0.25)
    told = decode(ask(session, rig.keys.param("pickup-1.x")), Readback)
    assert (told.value, told.pending) == (0.25, False)
    osc.send("/drumstick/play/strike", 0.3, 0.1, 0.5)
    wait_for("a drum that hears there", lambda: meters.got and meters.got[-1].revision >= told.revision)
    osc.send("/drumstick/param/pickup-1.y", 1.0)
    assert "outside the rim" in str(osc.receive("/drumstick/error")[1])
    assert decode(ask(session, rig.keys.param("pickup-1.y")), Readback).value == 0.6
