"""Stems: pickups and microphones by themselves, whose sum is the mix, whatever renders the drum."""

import dataclasses

import numpy as np
import pytest

import drumstick as ds
from drumstick.drum.block import render_unlimited
from drumstick.drum.calibrate import build, strike_for_speed
from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.limiter import limit
from drumstick.drum.render import LiveChange, mixed, parts, render
from drumstick.drum.stems.separation import has_rest, separated, source_names
from drumstick.parameters.scene import Scene

RATE = 48_000
ABOVE = ((-0.3, 0.3, 0.3, -0.4), (0.4, 0.4, 0.3, 0.4))


def _with(name: str, **listen: object) -> Scene:
    scene = ds.scene(name)
    return dataclasses.replace(scene, listen=dataclasses.replace(scene.listen, **listen))


def _meshed(name: str) -> Scene:
    return dataclasses.replace(ds.scene(name), modal=None)


def _stems_and_mix(
    scene: Scene, speed_m_per_s: float = 1.5, changes: tuple[LiveChange, ...] = (), x: float = 0.5
) -> tuple[np.ndarray, np.ndarray]:
    blows = [strike_for_speed(scene, speed_m_per_s, x, 0.1, 0.02)]
    found = [p.copy() for p in parts(scene, blows, 0.3, RATE, changes=changes, stems=True)]
    return np.concatenate(found), render(scene, blows, 0.3, RATE, changes=changes)


SCENES = {
    "pickups": lambda: ds.scene("roll"),
    "microphones": lambda: _with("roll", microphones=ABOVE),
    "a second head": lambda: ds.scene("tom"),
    "a bank, microphones": lambda: ds.scene("bass-drum"),
    "a bank, pickups": lambda: ds.scene("low-timpani"),
    "air on a mesh": lambda: _meshed("low-timpani"),
    "a hoop": lambda: ds.scene("cross-stick"),
}


@pytest.mark.parametrize(
    "kind",
    [
        "pickups",
        "microphones",
        pytest.param("a second head", marks=pytest.mark.long),
        pytest.param("a bank, microphones", marks=pytest.mark.long),
        pytest.param("a bank, pickups", marks=pytest.mark.long),
        pytest.param("air on a mesh", marks=pytest.mark.long),
        pytest.param("a hoop", marks=pytest.mark.long),
    ],
)
def test_the_sum_of_all_stems_is_the_mix(kind: str) -> None:
    scene = SCENES[kind]()
    stems, mix = _stems_and_mix(scene, x=0.97 if has_rest(scene) else 0.5)  # a hoop answers at the rim
    pairs = stems.reshape(len(stems), -1, 2)
    assert pairs.shape[1] == 1 + len(source_names(scene))
    assert np.abs(mix).max() > 0.05
    assert mixed(stems) == pytest.approx(mix, abs=1e-6)
    loudest = np.abs(pairs).max(axis=(0, 2))
    assert (loudest[1:] > 0.01).all()
    assert (loudest[0] > 1e-3) == has_rest(scene), "beside the pickups only a hoop sounds"
    quiet, loud = np.abs(pairs[:, 1]).max(axis=0)[::-1]  # the first is on the left in every scene
    assert loud > quiet


def test_a_stem_is_what_its_microphone_alone_would_give() -> None:
    scene = _with("roll", microphones=ABOVE)
    stems, _ = _stems_and_mix(scene)
    lone = _with("roll", microphones=ABOVE[1:])
    ring = StrikeRing()
    engine, both = build(lone, RATE, ring), build(scene, RATE, ring)
    blows = [strike_for_speed(scene, 1.5, 0.5, 0.1, 0.02)]
    as_loud = float(both.control["output_gain"][0] / engine.control["output_gain"][0])
    assert stems[:, 4:6] == pytest.approx(as_loud * render(lone, blows, 0.3, RATE), abs=2e-6)


def test_stems_are_not_limited_and_the_mix_of_them_is() -> None:
    loud = _with("roll", gain_dB=12.0)
    stems, mix = _stems_and_mix(loud, 4.0)
    total = stems.reshape(len(stems), -1, 2).sum(axis=1)
    assert np.abs(total).max() > 1.2
    assert np.abs(mix).max() <= 1.0
    limit(total)
    assert total == pytest.approx(mix, abs=1e-5)


def test_a_drum_that_takes_anothers_place_has_stems_too() -> None:
    changes = (LiveChange(0.1, "drum.f01", 300.0), LiveChange(0.15, "listen.pan", 0.5))
    stems, mix = _stems_and_mix(ds.scene("roll"), changes=changes)
    assert mixed(stems) == pytest.approx(mix, abs=1e-6)


@pytest.mark.long
def test_a_force_that_is_streamed_sounds_in_the_stems_too() -> None:
    scene = ds.scene("paper-roll")
    force = 20.0 * np.sin(np.linspace(0.0, np.pi, 20))
    given = [StreamedContact(40, 1000.0, 0.5, 0.0, force, True)]
    stems = np.concatenate([p.copy() for p in parts(scene, [], 0.3, RATE, given, stems=True)])
    mix = render(scene, [], 0.3, RATE, given)
    assert np.abs(mix).max() > 0.01
    assert mixed(stems) == pytest.approx(mix, abs=1e-6)


def test_a_name_that_the_scene_has_not_is_refused() -> None:
    scene = ds.scene("roll")
    engine = build(scene, RATE, StrikeRing())
    assert separated(engine, scene, ()) is engine
    with pytest.raises(ValueError, match="roll has no microphone-1; it has pickup-1, pickup-2"):
        separated(engine, scene, ("microphone-1",))


def test_meters_and_views_show_the_whole_drum() -> None:
    scene = ds.scene("roll")
    found = []
    for apart in ((), ("pickup-1", "pickup-2")):
        ring = StrikeRing()
        engine = build(scene, RATE, ring, apart)
        ring.push_blow(strike_for_speed(scene, 1.5, 0.5, 0.1, 0.0))
        render_unlimited(engine, np.zeros((4096, 2 + 2 * len(apart)), np.float32), 128, 0)
        found.append((float(engine.meters["peak_left"][0]), float(engine.meters["peak_right"][0])))
    assert found[0][0] > 0.05
    assert found[1] == pytest.approx(found[0], rel=1e-5)
