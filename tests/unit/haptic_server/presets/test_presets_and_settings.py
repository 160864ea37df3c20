"""Presets on the parameters: one set through the envelope, and what is restored at a start."""

import dataclasses
import errno
import hashlib
import os
from collections.abc import Mapping
from pathlib import Path

import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal, values_of
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.settings import Parameters
from haptic_server.presets.preset import PresetError
from haptic_server.presets.store import PresetStore
from protocol.messages import PresetNews
from protocol.requests import ANYBODY, Claim

ROLL = parse(shipped_text("roll"), "roll")
TOM = parse(shipped_text("cor-roll"), "cor-roll")


class Bench:
    """A gateway's parameters and presets in a folder; `scene` may be another one than the last time."""

    def __init__(self, folder: Path, scene: Scene = ROLL) -> None:
        run = folder / f"run {scene.name}"
        run.mkdir(exist_ok=True)
        self.block = blocks.create(run, law_of(scene))
        self.parameters = Parameters(scene, ServoLink(run, law_of(scene)))
        self.store = PresetStore(folder / "state")
        given = values_of(law_of(scene), self.parameters.table)
        self.presets = Presets(self.store, self.parameters, scene.name, given, now=lambda: "now")
        self.news: list[PresetNews] = []
        self.presets.on_news = self.news.append

    def keep(self, changes: Mapping[str, float]) -> None:
        """As if the servo had used these for a while."""
        self.parameters.set(changes, "test")
        keeper = self.presets.keep_last()
        keeper.note(self.parameters.accepted_values(), 0)
        keeper.close()


SOUNDING = {
    "where the pickups were": (
        parse('[listen]\npickup_places = "live"\n', "live"),
        {"pickup-1.x": 0.0, "pickup-1.y": 0.125, "pickup-2.x": -0.5, "pickup-2.y": -0.25},
        {"pickup-1.x": 0.5, "pickup-2.y": 0.75},
    ),
    "how far a stroke glides": (
        parse(shipped_text("low-tom"), "low-tom"), {"tension.young": 2.5}, {"tension.young": 12.0}
    ),
    "the second head's pitch": (
        parse(shipped_text("snare"), "snare"), {"cavity.f01": 420.0}, {"cavity.f01": 250.0}
    ),
}  # fmt: skip


@pytest.mark.parametrize(("scene", "saved", "then"), SOUNDING.values(), ids=SOUNDING)
def test_a_preset_recalls(
    tmp_path: Path, scene: Scene, saved: dict[str, float], then: dict[str, float]
) -> None:
    bench = Bench(tmp_path, scene)
    bench.parameters.set(saved, "test")
    bench.presets.save("kept", "test")
    bench.parameters.set(then, "test")
    assert bench.presets.load("kept", "test", ANYBODY).reply.values.items() >= saved.items()
    assert bench.parameters.accepted_values().items() >= saved.items()


def test_what_is_saved_is_what_was_accepted_last(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.parameters.set({"dv_pls": 0.3, "k_hand": 30.0}, "test")
    saved = bench.presets.save("slow", "test")
    assert (saved.values["dv_pls"], saved.values["k_hand"]) == (0.3, 30.0)
    assert "z_h0" not in saved.values
    bench.parameters.set({"dv_pls": 0.2, "k_hand": 20.0}, "test")
    loaded = bench.presets.load("slow", "test", ANYBODY)
    assert loaded.reply.revision == bench.parameters.revision == 3
    assert bench.parameters.accepted_values()["dv_pls"] == 0.3
    assert bench.news == [PresetNews(what=what, name="slow") for what in ("saved", "loaded")]


def test_a_preset_of_another_scene_is_refused_whole(tmp_path: Path) -> None:
    other = Bench(tmp_path, TOM)
    other.presets.save("cor", "test")
    bench = Bench(tmp_path)
    before = bench.parameters.accepted_values()
    with pytest.raises(Refusal, match=r"preset cor is of the scene cor-roll; not in roll: .*gamma"):
        bench.presets.load("cor", "test", ANYBODY)
    assert bench.parameters.accepted_values() == before
    assert bench.news == []


def test_a_preset_of_the_scene_as_it_was_before_a_parameter_went_says_so(tmp_path: Path) -> None:
    before = Bench(tmp_path, parse('[listen]\npickup_places = "live"\n', "mine"))
    before.presets.save("close", "test")
    now = Bench(tmp_path, parse("", "mine"))
    with pytest.raises(
        Refusal, match=r"preset close is of an earlier version of mine; not in mine: pickup-1.x"
    ):
        now.presets.load("close", "test", ANYBODY)


def test_the_envelope_and_the_lease_hold_for_presets_too(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    found = bench.presets.save("wild", "test")
    bench.store.save(dataclasses.replace(found, values={**found.values, "m": 1e-4, "dv_pls": 10.0}))
    with pytest.raises(Refusal, match="limit"):
        bench.presets.load("wild", "test", ANYBODY)
    bench.presets.save("tame", "test")
    bench.parameters.take_lease("mine", "Ada", 5.0)
    with pytest.raises(Refusal, match="Ada is tuning"):
        bench.presets.load("tame", "test", ANYBODY)
    assert bench.presets.load("tame", "test", Claim("mine")).note == ""


def test_a_lock_keeps_others_from_renaming_and_deleting(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.presets.save("slow", "test")
    bench.parameters.take_lease("mine", "Ada", 5.0)
    for claim in (ANYBODY, Claim("yours")):
        with pytest.raises(Refusal, match="Ada is tuning"):
            bench.presets.rename("slow", "fast", "test", claim)
        with pytest.raises(Refusal, match="Ada is tuning"):
            bench.presets.delete("slow", "test", claim)
    assert [row.name for row in bench.presets.list()] == ["slow"]
    bench.news.clear()
    renamed = bench.presets.rename("slow", "fast", "test", Claim("mine"))
    assert renamed == PresetNews(what="renamed", name="fast", before="slow")
    assert [row.name for row in bench.presets.list()] == ["fast"]
    deleted = bench.presets.delete("fast", "test", Claim("mine"))
    assert bench.presets.list() == []
    assert bench.news == [renamed, deleted]
    with pytest.raises(PresetError, match="no preset 'fast'"):
        bench.presets.delete("fast", "test", Claim("mine"))
    assert bench.news == [renamed, deleted]


def test_a_rename_that_leaves_the_old_name_behind_is_told_to_every_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(tmp_path)
    bench.presets.save("slow", "test")
    bench.news.clear()

    def refusing(file: Path) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(file))

    monkeypatch.setattr(os, "unlink", refusing)
    with pytest.raises(
        PresetError,
        match=r"there is a preset 'fast' now, and 'slow' too: .* cannot be removed: .*; delete one of the two",
    ):
        bench.presets.rename("slow", "fast", "test", ANYBODY)
    assert [row.name for row in bench.presets.list()] == ["fast", "slow"]
    assert bench.news == [PresetNews(what="saved", name="fast")]


def test_an_older_version_is_told_once_in_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench(tmp_path)
    bench.presets.save("slow", "test")
    place = bench.store.save(bench.presets.save("slow", "test"))
    place.write_bytes(b"")
    for _ in range(10):
        assert "is used" in bench.presets.load("slow", "test", ANYBODY).note
    assert caplog.text.count("is used") == 1


def test_the_last_good_set_is_taken_up_again(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    Bench(tmp_path).keep({"dv_pls": 0.3})
    again = Bench(tmp_path)
    again.presets.restore()
    assert again.parameters.accepted_values()["dv_pls"] == 0.3
    assert "as it was at now: dv_pls 0.3" in caplog.text


def test_what_nobody_changed_is_not_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    Bench(tmp_path).presets.restore()
    assert caplog.text == ""
    bench = Bench(tmp_path)
    bench.keep({"dv_pls": 0.3})
    bench.keep({"dv_pls": 0.2})
    again = Bench(tmp_path)
    again.presets.restore()
    assert again.parameters.revision == 0
    assert caplog.text == ""


def test_a_scene_that_was_changed_since_is_played_as_it_is_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Bench(tmp_path).keep({"dv_pls": 0.3})
    text = shipped_text("roll").replace("k_coll_N_per_m = 5000", "k_coll_N_per_m = 5500")
    changed = parse(text, "roll")
    assert changed != ROLL
    again = Bench(tmp_path, changed)
    again.presets.restore()
    assert again.parameters.revision == 0
    assert "the scene was changed since" in caplog.text


@pytest.mark.parametrize(("missing", "restored"), [({"tau"}, True), ({"tau", "dv_pls"}, False)])
def test_a_parameter_that_came_with_an_upgrade_is_no_change_of_the_scene_but_a_new_effect_is(
    tmp_path: Path, missing: set[str], restored: bool
) -> None:
    bench = Bench(tmp_path)
    bench.keep({"k_coll": 5500.0})
    found = bench.store.load_last()
    assert found is not None
    values, before = (
        {name: v for name, v in table.items() if name not in missing}
        for table in (found.preset.values, found.preset.before)
    )
    bench.store.save_last(dataclasses.replace(found.preset, values=values, before=before))
    again = Bench(tmp_path)
    again.presets.restore()
    assert (again.parameters.accepted_values()["k_coll"] == 5500.0) is restored


def test_another_scenes_last_set_is_left_alone(tmp_path: Path) -> None:
    Bench(tmp_path).keep({"dv_pls": 0.3})
    other = Bench(tmp_path, TOM)
    other.presets.restore()
    assert other.parameters.revision == 0


def test_a_last_set_with_a_number_of_thousands_of_digits_does_not_stop_the_start(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(tmp_path)
    bench.keep({"dv_pls": 0.3})
    last = tmp_path / "state" / "last.preset"
    body = last.read_bytes().partition(b"\n")[2].replace(b'"dv_pls": 0.3', b'"dv_pls": ' + b"9" * 4000)
    last.write_bytes(f"drumstick-preset 1 sha256={hashlib.sha256(body).hexdigest()}\n".encode() + body)
    again = Bench(tmp_path)
    again.presets.restore()
    assert again.parameters.revision == 0
    assert "the last good set cannot be" in caplog.text
    again.keep({"dv_pls": 0.4})  # nor does it keep the next one from being kept
    assert again.store.load_last() is not None


def test_one_that_is_damaged_or_no_longer_allowed_does_not_stop_the_start(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(tmp_path)
    bench.keep({"dv_pls": 0.3})
    found = bench.store.load_last()
    assert found is not None
    bench.store.save_last(dataclasses.replace(found.preset, values={"m": 1e-4, "dv_pls": 10.0}))
    Bench(tmp_path).presets.restore()
    assert "the last good set cannot be" in caplog.text
    caplog.clear()
    for file in (tmp_path / "state").glob("last.*"):
        file.write_bytes(b"rubbish")
    with pytest.raises(PresetError):
        bench.store.load_last()
    again = Bench(tmp_path)
    again.presets.restore()
    assert again.parameters.revision == 0
    assert "not a preset of this version" in caplog.text
