"""Strikes that the offline renderer takes from a recording."""

import json
import wave
from pathlib import Path

import numpy as np
import pytest

from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import LiveChange
from drumstick.drum.render import render as sound_of
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from protocol.messages import Contact, Readback
from recordings import a_choke, a_strike, made
from rig.exit_status import GIVEN, CommandError
from rig.offline.recorded_strikes import played
from rig.offline.render import RenderOptions, render
from rig.offline.streamed_roll import presses
from streamed_engine import streamed


def test_strikes_are_played_once_at_their_instants_by_their_estimates(tmp_path: Path) -> None:
    strikes = [
        (2.0, a_strike(5)),
        (2.043, a_strike(6, peak_N=3.0)),
        (2.043, a_strike(6)),
        (2.5, a_strike(7, x=-0.2)),
    ]
    path = made(tmp_path / "a.mcap", [(at, "/strike", strike) for at, strike in strikes])
    found = played(path, Scene("any"))
    assert [blow.t_s for blow in found.blows] == pytest.approx([0.05, 0.093, 0.55], abs=1e-6)
    assert [blow.peak_N for blow in found.blows] == [4.0, 3.0, 4.0]
    assert [(blow.x, blow.y, blow.contact_s) for blow in found.blows][2] == (-0.2, 0.1, 0.0055)
    assert found.presses == []
    assert found.length_s == pytest.approx(1.55)


def test_what_no_stick_can_do_is_left_out_and_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = made(tmp_path / "a.mcap", [(0, "/strike", a_strike(1)), (1, "/strike", a_strike(2, peak_N=1e9))])
    assert len(played(path, Scene("any")).blows) == 1
    assert "1 strikes left out that no stick can make" in capsys.readouterr().err


def test_a_torn_recording_is_played_and_said_to_be_torn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = made(tmp_path / "a.mcap", [(k, "/strike", a_strike(k)) for k in range(3)], finished=False)
    assert len(played(path, Scene("any")).blows) == 3
    assert "was cut off" in capsys.readouterr().err


def test_what_was_set_in_the_drum_is_set_again_and_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    muffled = parse("[drum.effects.muffle]\n", "muffled")
    messages = [
        (1.0, "/param/muffle", Readback(value=0.25, revision=1)),  # as the recorder asked when it began
        (2.0, "/strike", a_strike(5)),
        (2.2, "/param/dv_pls", Readback(value=0.3, revision=2)),
        (2.3, "/param/muffle", Readback(value=0.75, revision=3)),
        (2.4, "/param/muffle", Readback(value=7.0, revision=4)),
    ]
    path = made(tmp_path / "a.mcap", messages, muffled)
    found = played(path, muffled).changes
    assert [(change.name, change.value) for change in found] == [("muffle", 0.25), ("muffle", 0.75)]
    assert [change.t_s for change in found] == pytest.approx([0.0, 0.35], abs=1e-6)
    assert "1 settings of the drum left out that are out of range" in capsys.readouterr().err
    assert played(path, Scene("any")).changes == []


def test_a_recorded_glide_is_set_where_it_counts(tmp_path: Path) -> None:
    gliding, stiff = (
        parse(f"[drum.effects.tension]\n{key}\n", "a") for key in ("glide_cents = 60", "young_GPa = 5")
    )
    messages = [
        (2.0, "/strike", a_strike(5)),
        (2.3, "/param/tension.glide", Readback(value=120.0, revision=3)),
    ]
    path = made(tmp_path / "a.mcap", messages, gliding)
    changes = played(path, gliding).changes
    assert [(change.name, change.value) for change in changes] == [("tension.glide", 120.0)]
    assert played(path, stiff).changes == []


def test_what_one_set_changed_changes_at_once_however_it_was_heard(tmp_path: Path) -> None:
    live = parse('[listen]\npickup_places = "live"\n', "live")
    told = [
        (2.2, "x", 0.1, 5),
        (2.2004, "y", 0.2, 5),
        (2.25, "x", 0.3, 6),
        (2.251, "y", 0.4, 6),
        (2.3, "x", 0.5, 6),  # of a servo that was started anew
        (2.302, "y", 0.6, 6),
    ]
    messages = [
        (at_s, f"/param/pickup-1.{axis}", Readback(value=value, revision=revision))
        for at_s, axis, value, revision in told
    ]
    path = made(tmp_path / "a.mcap", [(2.0, "/strike", a_strike(5)), *messages], live)
    found = played(path, live).changes
    assert [(change.name[-1], change.value) for change in found] == [each[1:3] for each in told]
    assert [change.t_s for change in found] == pytest.approx([0.25, 0.25, 0.3, 0.3, 0.35, 0.35], abs=1e-6)


def test_a_muffle_that_is_set_is_heard_from_there_on() -> None:
    loose = parse(
        "[drum]\nt60_s = 2.0\n[drum.effects.muffle]\npress = 0.0\npatches = [[0, 0, 1]]\nt60_s = 0.1\n",
        "loose",
    )
    blows = [OfflineStrike(0.05, 0.3, 0.1, 4.0, 0.005)]
    rings = sound_of(loose, blows, 1.0, 48_000)
    muted = sound_of(loose, blows, 1.0, 48_000, (), [LiveChange(0.5, "muffle", 1.0)])
    np.testing.assert_array_equal(muted[:24_000], rings[:24_000])
    assert np.abs(muted[36_000:]).max() < 0.1 * np.abs(rings[36_000:]).max()


def test_a_pitch_that_is_set_holds_for_later_strikes_and_the_drum_before_rings_on() -> None:
    scene, high = parse("[drum]\nf01_Hz = 150.0\n", "low"), parse("[drum]\nf01_Hz = 200.0\n", "high")
    early, late = OfflineStrike(0.05, 0.3, 0.1, 4.0, 0.005), OfflineStrike(1.25, 0.3, 0.1, 4.0, 0.005)
    changes = [LiveChange(0.5, "listen.gain", -6.0), LiveChange(0.5, "drum.f01", 200.0)]
    sound = sound_of(scene, [early, late], 2.0, 48_000, (), changes)
    np.testing.assert_array_equal(
        sound[:48_000], sound_of(scene, [early, late], 1.0, 48_000, (), changes[:1])
    )
    assert not sound[54_000:60_000].any()
    quiet = sound_of(high, [late], 2.0, 48_000, (), [LiveChange(0.0, "listen.gain", -6.0)])
    assert sound[60_000:] == pytest.approx(quiet[60_000:], abs=1e-5)
    jumps = np.abs(np.diff(sound[:60_000], n=3, axis=0)).max(axis=1)
    assert jumps[24_100:].max() < jumps[12_000:24_000].max()


def test_the_force_of_one_contact_goes_to_one_drum() -> None:
    low, high = (parse(f'[drum]\nexcitation = "streamed"\nf01_Hz = {f}\n', "drum") for f in (150.0, 200.0))
    forces = np.full(200, 0.5)
    contacts = [
        StreamedContact(400, 1000.0, 0.3, 0.1, forces),
        StreamedContact(1500, 1000.0, 0.3, 0.1, forces),
    ]
    sound = sound_of(low, (), 2.0, 48_000, contacts, [LiveChange(0.5, "drum.f01", 200.0)])
    np.testing.assert_array_equal(sound[:48_000], sound_of(low, (), 1.0, 48_000, contacts))
    assert sound[72_000:] == pytest.approx(sound_of(high, (), 2.0, 48_000, contacts[1:])[72_000:], abs=1e-5)


def test_a_recorded_choke_is_where_it_was_and_one_before_the_first_strike_is_none(tmp_path: Path) -> None:
    messages = [
        (1.0, "/choke", a_choke(1)),
        (2.0, "/strike", a_strike(5)),
        (2.3, "/choke", a_choke(2)),
        (2.5, "/strike", a_strike(6)),
    ]
    path = made(tmp_path / "a.mcap", messages)
    assert played(path, Scene("any")).chokes == pytest.approx([0.35], abs=1e-6)
    scene_file = tmp_path / "drum.toml"
    scene_file.write_text("[drum]\nt60_s = 3.0\n", encoding="utf-8")
    render(str(scene_file), RenderOptions(tmp_path / "a.wav", 0.6, path, False, 48000), as_json=True)
    with wave.open(str(tmp_path / "a.wav")) as found:
        sound = np.frombuffer(found.readframes(found.getnframes()), "<i2").reshape(-1, 2)
    level = [np.abs(sound[round(48_000 * t_s) :][:2000]).max() for t_s in (0.3, 0.4, 0.56)]
    assert level[0] > 0
    assert level[1] == 0
    assert level[2] > 0


@pytest.mark.parametrize("text", ["[drum]\n", "[modal]\ntop_Hz = 3000.0\n", "[drum.effects.tension]\n"])
def test_a_choke_ends_what_rings_without_a_click_and_the_next_strike_is_whole(text: str) -> None:
    scene = parse(text, "drum")
    early, late = (OfflineStrike(t_s, 0.3, 0.1, 4.0, 0.005) for t_s in (0.05, 0.31))
    rings = sound_of(scene, [early], 0.5, 48_000)
    sound = sound_of(scene, [early, late], 0.5, 48_000, chokes=[0.3])  # the second one falls into the fade
    alone = sound_of(scene, [late], 0.5, 48_000)
    np.testing.assert_array_equal(sound[:14_400], rings[:14_400])
    assert sound[15_840:] == pytest.approx(alone[15_840:], abs=1e-4)
    assert np.abs(alone[15_840:]).max() > 0.01
    faded = sound_of(scene, [early], 0.5, 48_000, chokes=[0.3])
    assert not faded[15_840:].any()
    half = slice(15_120, 15_840)
    assert np.abs(faded[half]).max() < 0.5 * np.abs(rings[half]).max()
    rough, usual = (np.abs(np.diff(each[9_600:], n=3, axis=0)).max() for each in (faded, rings))
    assert rough <= 1.2 * usual


def test_strikes_and_chokes_of_one_instant_keep_their_order_and_a_drum_that_rings_on_is_choked_too() -> None:
    low, high = parse("[drum]\nf01_Hz = 150.0\n", "low"), parse("[drum]\nf01_Hz = 200.0\n", "high")
    early, late = OfflineStrike(0.05, 0.3, 0.1, 4.0, 0.005), OfflineStrike(0.6, 0.3, 0.1, 4.0, 0.005)
    changes = [LiveChange(0.5, "drum.f01", 200.0)]
    sound = sound_of(low, [early, late], 1.0, 48_000, (), changes, [0.6])
    assert sound[30_240:] == pytest.approx(sound_of(high, [late], 1.0, 48_000)[30_240:], abs=1e-4)


def test_the_rest_of_a_contact_that_is_choked_is_not_heard_and_the_next_one_is() -> None:
    scene = parse('[drum]\nexcitation = "streamed"\n', "drum")
    forces = np.full(200, 0.5)
    contacts = [
        StreamedContact(400, 1000.0, 0.3, 0.1, forces),
        StreamedContact(700, 1000.0, 0.3, 0.1, forces),
        StreamedContact(1010, 1000.0, 0.3, 0.1, forces),
    ]
    sound = sound_of(scene, (), 1.3, 48_000, contacts, chokes=[0.5, 1.0])
    assert not sound[25_440:33_500].any()
    alone = sound_of(scene, (), 1.3, 48_000, contacts[1:2], chokes=[1.0])
    assert sound[33_600:48_000] == pytest.approx(alone[33_600:48_000], abs=1e-5)
    last = sound_of(scene, (), 1.3, 48_000, contacts[2:])
    assert sound[49_440:] == pytest.approx(last[49_440:], abs=1e-5)
    assert np.abs(last[49_440:]).max() > 0.001


def piece(seq: int, tick: int, forces: list[float], rate_Hz: float = 1000.0, **place: float) -> Contact:
    packed = np.array(forces, "<f4").tobytes()
    return Contact(
        boot=7, seq=seq, first_tick=tick, rate_Hz=rate_Hz, forces=packed, t_ns=tick * 1_000_000, **place
    )


def test_a_scene_that_streams_is_played_by_the_recorded_forces(tmp_path: Path) -> None:
    pieces = [
        (3.0, piece(1, 3000, [1.0, 2.0], x=0.3, y=0.1)),
        (3.002, piece(1, 3002, [3.0, 0.0], x=0.3, y=0.1)),
        (3.002, piece(1, 3002, [3.0, 0.0], x=0.3, y=0.1)),
        (3.043, piece(2, 3043, [5.0])),
    ]
    told = [(at, "/contact", each) for at, each in pieces]
    path = made(tmp_path / "a.mcap", [(3.04, "/strike", a_strike(2)), *told])
    found = played(path, streamed())
    assert [(p.first_tick, p.x, p.y, p.forces_N.tolist()) for p in found.presses] == [
        (50, 0.3, 0.1, [1.0, 2.0]),
        (52, 0.3, 0.1, [3.0, 0.0]),
        (93, 0.4, 0.1, [5.0]),
    ]
    assert found.blows == []
    assert found.length_s == pytest.approx(1.094)


def test_what_was_played_without_the_stick_sounds_beside_the_forces(tmp_path: Path) -> None:
    messages = [
        (2.9, "/strike", a_strike(1, boot=99, source="osc a")),
        (3.0, "/contact", piece(1, 3000, [1.0, 2.0, 0.0])),
        (3.0, "/strike", a_strike(1)),
    ]
    found = played(made(tmp_path / "a.mcap", messages), streamed())
    assert [blow.t_s for blow in found.blows] == pytest.approx([0.05])
    assert [press.first_tick for press in found.presses] == [150]


def test_an_arms_contact_counts_once_however_often_its_force_is_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Between z = 0 and where strikes are told apart, an arm in contact is not pushed: a piece may end there."""
    pieces = [
        (3.0, piece(1, 3000, [1.0, 0.0])),
        (3.002, piece(1, 3002, [0.0, 0.0])),
        (3.004, piece(1, 3004, [2.0, 0.0])),
        (3.006, piece(1, 3006, [0.0])),
        (3.043, piece(2, 3043, [5.0])),  # cut off before it ended
    ]
    path = made(tmp_path / "a.mcap", [(at, "/contact", each) for at, each in pieces])
    found = played(path, streamed())
    assert [press.begins for press in found.presses] == [True, False, False, False, True]
    scene_file = tmp_path / "streamed.toml"
    scene_file.write_text('[drum]\nexcitation = "streamed"\n', encoding="utf-8")
    wishes = RenderOptions(tmp_path / "a.wav", 0.2, path, False, 48000)
    render(str(scene_file), wishes, as_json=True)
    assert json.loads(capsys.readouterr().out)["strikes"] == 2


@pytest.mark.parametrize(
    ("messages", "scene", "words"),
    [
        ([], Scene("any"), "no strikes in it"),
        (
            [(0.0, "/strike", a_strike(1))],
            streamed(),
            "record with --force, or render with a scene whose [drum]",
        ),
        (
            [(0.0, "/contact", piece(1, 1, [1.0])), (1.0, "/contact", piece(2, 9, [1.0], rate_Hz=2000.0))],
            streamed(),
            "several rates, 1000, 2000 Hz",
        ),
    ],
)
def test_what_cannot_be_played_is_said(
    tmp_path: Path, messages: list[tuple[float, str, Contact]], scene: Scene, words: str
) -> None:
    path = made(tmp_path / "a.mcap", messages)
    with pytest.raises(CommandError) as stop:
        played(path, scene)
    assert words in str(stop.value)
    assert stop.value.status == GIVEN


def test_a_streamed_roll_comes_through_a_recording_tick_by_tick(tmp_path: Path) -> None:
    """Roll of `render --roll`, told in pieces as a gateway does, recorded and read: the same forces."""
    scene = streamed()
    rolled = list(presses(scene, 0.8))
    messages: list[tuple[float, str, Contact]] = []
    for seq, press in enumerate(rolled):
        for done in range(0, len(press.forces_N), 2):
            tick = press.first_tick + done
            place = {"x": press.x, "y": press.y}
            messages.append(
                (tick / 1000, "/contact", piece(seq, tick, press.forces_N[done : done + 2].tolist(), **place))
            )
    found = played(made(tmp_path / "a.mcap", messages), scene).presses
    assert len(rolled) > 10
    told, asked = _ticks(found), _ticks(rolled)
    shift = min(told) - min(asked)
    assert min(told) == 50
    assert {tick - shift: force for tick, force in told.items()} == asked


def _ticks(presses: list[StreamedContact]) -> dict[int, tuple[float, float, float]]:
    return {
        press.first_tick + k: (np.float32(force), press.x, press.y)
        for press in presses
        for k, force in enumerate(press.forces_N.tolist())
    }
