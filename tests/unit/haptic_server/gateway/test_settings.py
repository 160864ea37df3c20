"""Parameters of the gateway: sets whole through the envelope, readbacks from the servo, nothing accepted lost."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from drumstick.parameters.drum import Listen
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from haptic_server import block as blocks
from haptic_server import files
from haptic_server.block_header import ARM
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.settings import Parameters
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from protocol.requests import ANYBODY, Claim
from realtime.atomics import poke

ROLL = parse(shipped_text("roll"), "roll")


class Bench:
    """A servo in virtual time, and a gateway's parameters on the same block."""

    def __init__(self, folder: Path, scene: Scene = ROLL) -> None:
        self.folder = folder
        self.scene = scene
        self.now = 0
        self.start_servo()
        self.start_gateway()

    def start_servo(self) -> None:
        self.servo = memory.prepare(self.scene, blocks.create(self.folder, law_of(self.scene)))

    def start_gateway(self) -> None:
        self.link = ServoLink(self.folder, law_of(self.scene))
        self.parameters = Parameters(self.scene, self.link, rig="left")

    def tick(self, count: int) -> None:
        self.now = loop.run_virtual(self.servo, count, self.now)

    def echoes(self) -> dict[str, float]:
        live = self.link.take_live()
        return {} if live is None else {e.name: e.value for e in self.parameters.latched(*live)}


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_what_is_shown_is_the_servos(bench: Bench) -> None:
    reply = bench.parameters.set({"dv_pls": 0.3}, "test")
    assert reply.values == {"dv_pls": 0.3}
    assert bench.parameters.values()["dv_pls"] == 0.2
    assert bench.parameters.pending
    bench.tick(200)
    assert bench.echoes() == {"dv_pls": 0.3}
    assert bench.parameters.values()["dv_pls"] == 0.3
    assert not bench.parameters.pending


@pytest.mark.parametrize("value", [0.002, 0.002 * (1 + 1e-9), float(np.float32(0.002))])
def test_a_set_that_changes_nothing_makes_no_revision_and_no_echo(bench: Bench, value: float) -> None:
    reply = bench.parameters.set({"tau": value, "dv_pls": 0.2}, "test")
    assert (reply.values, reply.revision, reply.pending) == ({"tau": 0.002, "dv_pls": 0.2}, 0, False)
    assert (bench.parameters.revision, bench.parameters.pending) == (0, False)
    bench.tick(200)
    assert bench.echoes() == {}


def test_what_is_compared_is_the_newest_accepted_set_though_it_waits(bench: Bench) -> None:
    first = bench.parameters.set({"dv_pls": 0.3}, "test")
    again = bench.parameters.set({"dv_pls": 0.3}, "another")
    assert (again.values, again.revision, again.pending) == ({"dv_pls": 0.3}, first.revision, True)
    other = bench.parameters.set({"tau": 0.002}, "another")  # is so already, whatever waits beside it
    assert (other.revision, other.pending) == (0, False)
    bench.parameters.set({"dv_pls": 0.2}, "back")  # what the servo uses, but not what was accepted
    assert bench.parameters.revision == first.revision + 1
    assert bench.parameters.set({"dv_pls": 0.2}, "back").pending
    bench.tick(200)
    assert bench.echoes() == {"dv_pls": 0.2}


def test_one_value_that_differs_makes_a_change_and_the_others_keep_their_last_digit(bench: Bench) -> None:
    before = bench.parameters.values()
    given = {name: float(np.float32(value)) for name, value in before.items() if name != "z_h0"}
    reply = bench.parameters.set({**given, "dv_pls": 0.3}, "test")
    assert (reply.revision, reply.pending) == (1, True)
    bench.tick(200)
    assert bench.echoes().keys() == given.keys()
    after = bench.parameters.values()
    assert {n: v for n, v in after.items() if n != "dv_pls"} == {
        n: v for n, v in before.items() if n != "dv_pls"
    }


def test_z_h0_in_a_batch_holds_although_it_is_so_already(bench: Bench) -> None:
    before = bench.parameters.values()
    bench.parameters.set({"k_hand": 40.0, "z_h0": before["z_h0"]}, "test")
    assert bench.parameters.accepted_values()["z_h0"] == pytest.approx(before["z_h0"], abs=1e-12)
    assert bench.parameters.accepted_values()["z_ss"] != before["z_ss"]


def test_what_changes_nothing_is_refused_beside_a_lease_and_by_an_old_revision(bench: Bench) -> None:
    bench.parameters.set({"dv_pls": 0.3}, "test")
    with pytest.raises(Refusal, match="for revision 0"):
        bench.parameters.set({"dv_pls": 0.3}, "test", Claim(revision=0))
    bench.parameters.take_lease("hers", "Ada", 5.0)
    with pytest.raises(Refusal, match="Ada is tuning"):
        bench.parameters.set({"dv_pls": 0.3}, "test")


def test_a_value_of_the_drum_goes_the_way_of_all_others_and_outlives_the_gateway(tmp_path: Path) -> None:
    bench = Bench(tmp_path, parse(shipped_text("cross-stick"), "cross-stick"))
    with pytest.raises(Refusal, match=r"muffle: 1.5 is outside 0 .. 1$"):
        bench.parameters.set({"muffle": 1.5, "dv_pls": 0.2}, "test")
    bench.parameters.set({"muffle": 0.25, "dv_pls": 0.2}, "test")
    bench.start_gateway()  # before the servo has taken it
    assert (bench.parameters.values()["muffle"], bench.parameters.accepted_values()["muffle"]) == (1.0, 0.25)
    bench.tick(200)
    assert bench.echoes() == {"muffle": 0.25, "dv_pls": 0.2}
    bench.start_gateway()
    assert bench.parameters.values()["muffle"] == 0.25
    bench.start_servo()
    assert bench.link.refresh()
    bench.parameters.servo_restarted()
    bench.tick(200)
    assert bench.echoes()["muffle"] == 0.25


def test_a_drum_that_no_scene_may_have_is_refused_with_the_reason(tmp_path: Path) -> None:
    bench = Bench(tmp_path, parse(shipped_text("snare"), "snare"))
    before = bench.parameters.accepted_values()
    with pytest.raises(Refusal, match=r"drum.effects.internal_loss.* must be shorter and higher"):
        bench.parameters.set({"drum.t60": 0.02, "listen.gain": -3.0}, "test")
    assert bench.parameters.accepted_values() == before
    bench.parameters.set({"drum.t60": 2.0, "drum.f01": 260.0}, "test")
    bench.tick(1)
    assert bench.echoes() == {"drum.t60": 2.0, "drum.f01": 260.0}


def test_the_glide_goes_the_way_of_all_others_where_it_counts(tmp_path: Path) -> None:
    bench = Bench(tmp_path, parse("[drum.effects.tension]\nglide_cents = 60\nmost_cents = 150\n", "gliding"))
    while bench.servo.motion["contact_phase"][0] == exact.ABOVE:
        bench.tick(1)
    bench.parameters.set({"tension.glide": 70.0}, "test")
    bench.tick(1)
    assert bench.echoes() == {"tension.glide": 70.0}
    before = bench.parameters.accepted_values()
    for changes, words in (
        (
            {"tension.glide": 120.0},
            r"drum\.effects\.tension\.most_cents 150 cents leave no room for glide_cents = 120",
        ),
        ({"tension.glide": 1300.0}, r"tension\.glide: 1300 cents is outside 0 \.\. 1200 cents"),
        ({"tension.young": 4.0}, r"tension\.young: no such parameter in this scene; it has .*tension\.glide"),
    ):
        with pytest.raises(Refusal, match=words):
            bench.parameters.set({**changes, "listen.gain": -3.0}, "test")
    assert bench.parameters.accepted_values() == before


def test_a_toms_stiffness_is_what_is_set_in_place_of_cents_that_nothing_follows(tmp_path: Path) -> None:
    bench = Bench(tmp_path, parse(shipped_text("low-tom"), "low-tom"))
    bench.parameters.set({"tension.young": 2.5}, "test")
    bench.tick(1)
    assert bench.echoes() == {"tension.young": 2.5}
    for changes, words in (
        ({"tension.glide": 120.0}, r"tension\.glide: no such parameter in this scene"),
        ({"tension.young": 0.0}, r"tension\.young: 0 GPa is outside 0\.01 \.\. 50 GPa"),
    ):
        with pytest.raises(Refusal, match=words):
            bench.parameters.set(changes, "test")


def test_the_second_heads_pitch_is_set_and_told_and_refused_with_the_reason(tmp_path: Path) -> None:
    bench = Bench(tmp_path, parse(shipped_text("snare"), "snare"))
    bench.parameters.set({"cavity.f01": 420.0}, "test")
    bench.tick(1)
    assert bench.echoes() == {"cavity.f01": 420.0}
    before = bench.parameters.accepted_values()
    for changes, words in (
        ({"cavity.f01": 0.0}, r"cavity\.f01: 0 Hz is outside 20 \.\. 2000 Hz"),
        ({"cavity.f01": 300.0, "drum.t60": 0.02}, r"drum.effects.internal_loss.* must be shorter and higher"),
    ):
        with pytest.raises(Refusal, match=words):
            bench.parameters.set(changes, "test")
    assert bench.parameters.accepted_values() == before


def test_pickups_go_the_way_of_all_others_and_not_beyond_the_rim(tmp_path: Path) -> None:
    listen = Listen(pickups=((0.5, 0.6, 0.0),), pickup_places="live")
    bench = Bench(tmp_path, dataclasses.replace(ROLL, listen=listen))
    while bench.servo.motion["contact_phase"][0] == exact.ABOVE:
        bench.tick(1)
    bench.parameters.set({"pickup-1.x": -0.25, "pickup-1.y": 0.125}, "test")
    bench.tick(1)  # it is only heard: no waiting until the stick is above the head
    assert bench.echoes() == {"pickup-1.x": -0.25, "pickup-1.y": 0.125}
    before = bench.parameters.accepted_values()
    with pytest.raises(Refusal, match=r"pickup 1 at x -0.25, y -1 of the radius is 1.03 .* outside the rim"):
        bench.parameters.set({"pickup-1.y": -1.0, "listen.gain": -3.0}, "test")
    assert bench.parameters.accepted_values() == before


def test_what_is_only_heard_waits_for_no_stick_and_what_is_felt_does(bench: Bench) -> None:
    while bench.servo.motion["contact_phase"][0] == exact.ABOVE:
        bench.tick(1)
    bench.parameters.set({"listen.mute": 1.0, "listen.gain": -20.0}, "test")
    bench.tick(1)
    assert bench.servo.motion["contact_phase"][0] != exact.ABOVE
    assert bench.echoes() == {"listen.mute": 1.0, "listen.gain": -20.0}
    bench.parameters.set({"listen.mute": 0.0, "dv_pls": 0.3}, "test")
    bench.tick(1)
    assert bench.servo.motion["contact_phase"][0] != exact.ABOVE
    assert bench.echoes() == {}
    bench.tick(200)
    assert bench.echoes() == {"listen.mute": 0.0, "dv_pls": 0.3}


def test_z_h0_is_echoed_when_the_mass_moves_it(bench: Bench) -> None:
    bench.parameters.set({"m": 0.02}, "test")
    bench.tick(200)
    echoes = bench.echoes()
    assert set(echoes) == {"m", "z_h0"}


def test_sets_build_on_what_was_accepted_before(bench: Bench) -> None:
    bench.parameters.set({"dv_pls": 0.3}, "one")
    bench.parameters.set({"k_hand": 40.0}, "another")
    bench.tick(200)
    assert bench.echoes().keys() >= {"dv_pls", "k_hand"}
    assert bench.servo.law["pulse"]["dv_pls"][0] == 0.3


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"dv_pls": 0.3, "nonsense": 1.0}, "no such parameter"),
        ({"dv_pls": 0.3, "tau": -1.0}, "outside"),
        ({"dv_pls": 0.3, "m": float("nan")}, "finite"),
        ({"dv_pls": 0.3, "r_in": 0.0, "r_out": 0.0}, "nothing damps"),
        ({"r_in": 0.05}, "at least r_out"),
        ({"m": 1e-4, "k_coll": 1e6}, "a buzz"),
        ({"z_ss": 1.0, "k_hand": 3000.0}, "the hand alone"),
        ({"dv_pls": 9.0}, "limit is 10 m/s"),
        ({"k_coll": 1e6, "m": 1.0}, "limit is"),
        ({"z_h0": 0.0, "z_ss": 0.0}, "two views"),
        ({}, "empty"),
    ],
)
def test_a_refused_set_leaves_everything_as_it_was(bench: Bench, changes: dict[str, float], why: str) -> None:
    before = bench.parameters.values()
    with pytest.raises(Refusal, match=why):
        bench.parameters.set(changes, "test")
    bench.tick(200)
    assert bench.parameters.values() == before
    assert not bench.parameters.pending


def test_a_new_gateway_finds_what_the_last_one_acknowledged(bench: Bench) -> None:
    bench.parameters.set({"dv_pls": 0.3}, "test")
    bench.tick(200)
    bench.parameters.set({"k_hand": 40.0}, "test")  # not taken by the servo yet when the gateway dies
    bench.start_gateway()
    assert bench.parameters.values()["dv_pls"] == 0.3
    bench.parameters.set({"tau": 0.003}, "test")
    bench.tick(200)
    bench.echoes()
    values = bench.parameters.values()
    assert (values["dv_pls"], values["k_hand"], values["tau"]) == (0.3, 40.0, 0.003)


def test_a_new_servo_gets_the_accepted_set_and_the_panic(bench: Bench) -> None:
    bench.parameters.set({"dv_pls": 0.3}, "test")
    bench.tick(200)
    bench.echoes()
    bench.parameters.panic("test")
    bench.tick(1)
    (
        bench.folder / files.BLOCK
    ).unlink()  # somebody emptied the run folder: only the gateway knows of the panic
    bench.start_servo()
    assert bench.link.refresh()
    bench.parameters.servo_restarted()
    bench.tick(200)
    assert bench.echoes()["dv_pls"] == 0.3
    assert bench.servo.tick_state["panicked"][0] == 1


def test_a_panic_that_the_old_servo_never_saw_reaches_the_new_one(bench: Bench) -> None:
    bench.parameters.panic("test")  # the old servo is dead: no tick takes it
    bench.start_servo()
    bench.tick(1)  # before the gateway has noticed
    assert bench.servo.tick_state["panicked"][0] == 1


def test_a_panic_before_the_gateway_has_noticed_a_new_servo_reaches_that_one(bench: Bench) -> None:
    bench.start_servo()
    bench.tick(1)
    bench.parameters.panic("test")
    bench.start_gateway()  # the one that raised it was killed
    bench.tick(1)
    assert bench.servo.tick_state["panicked"][0] == 1


def test_an_arm_is_known_at_once_whatever_came_between_two_looks(bench: Bench) -> None:
    for fault in (False, True):
        bench.parameters.panic("test")
        if fault:
            bench.servo.motion["v"] = math.nan  # hides the panic in the status
        bench.tick(1)
        with pytest.raises(Refusal, match="drumstick arm --rig left"):
            bench.parameters.require_quiet(ANYBODY)
        poke(bench.servo.block.control, ARM, 1)
        bench.tick(1)
        bench.parameters.require_quiet(ANYBODY)


def test_a_panic_that_was_cleared_does_not_come_back_with_a_new_servo(bench: Bench) -> None:
    bench.parameters.panic("test")
    bench.tick(1)
    poke(bench.servo.block.control, ARM, 1)
    bench.tick(1)
    bench.start_servo()
    assert bench.link.refresh()
    bench.parameters.servo_restarted()
    bench.tick(1)
    assert bench.servo.tick_state["panicked"][0] == 0


def test_what_the_servo_refuses_is_no_longer_claimed(bench: Bench) -> None:
    bench.parameters.set({"dv_pls": 0.3}, "test")
    bench.parameters.refused_by_servo(bench.parameters.revision)
    assert not bench.parameters.pending
    bench.parameters.set({"tau": 0.003}, "test")
    bench.tick(200)
    bench.echoes()
    assert bench.parameters.values()["dv_pls"] == 0.2


def test_a_flood_of_panics_is_one_line_in_the_log(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(1000):
        bench.parameters.panic("a flood")
    assert caplog.text.count("panic from a flood; clear it with: drumstick arm --rig left") == 1
    bench.tick(1)
    poke(bench.servo.block.control, ARM, 1)
    bench.tick(1)
    bench.parameters.panic("another")
    assert caplog.text.count("panic from") == 2
