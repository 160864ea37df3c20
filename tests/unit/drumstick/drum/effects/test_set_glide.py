"""Glide of the pitch as a live value: only the one that counts in a scene is one, and the drum set so has it."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
from drumstick.drum.render import LiveChange, render
from drumstick.parameters.drum import Drum, Modal
from drumstick.parameters.scene import Scene
from drumstick.safety.fence import fence_of, within
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal, scene_values, scene_with, table_of
from drumstick.stick.law import law_of

RATE_HZ, F01_HZ, STRUCK_S = 48_000, 150.0, 0.1
FULL, SOFT = 2.0, 0.02  # of the stick's speed, m/s
KINDS = {"mesh": None, "modes": Modal(top_Hz=2000.0)}
# Key, wire name, the scene's own value and the one that is set.
IN_BOTH = [("glide_cents", "tension.glide", 30.0, 240.0), ("young_GPa", "tension.young", 1.0, 8.0)]
Sound = npt.NDArray[np.float32]


def _scene(kind: str, **tension: float) -> Scene:
    drum = Drum(f01_Hz=F01_HZ, t60_s=4.0, effects={"tension": TensionTable(**tension)})
    return Scene("gliding", drum=drum, modal=KINDS[kind])


def _sound(scene: Scene, speed: float, *changes: LiveChange) -> Sound:
    blow = strike_for_speed(scene, speed, 0.5, 0.0, STRUCK_S)
    return render(scene, [blow], 0.6, RATE_HZ, (), changes)


def _pitch(sound: Sound, begin_s: float, end_s: float) -> float:
    # Of the lowest partial, Hz.
    part = sound[round(begin_s * RATE_HZ) : round(end_s * RATE_HZ), 0]
    size = 16 * RATE_HZ
    spectrum = np.abs(np.fft.rfft(part * np.hanning(len(part)), size))
    low, high = (round(f * size / RATE_HZ) for f in (0.8 * F01_HZ, 1.45 * F01_HZ))
    return (low + float(np.argmax(spectrum[low:high]))) * RATE_HZ / size


def _cents(sound: Sound, begin_s: float = 0.01, end_s: float = 0.06) -> float:
    # Above f01, from and to so long after the strike.
    return 1200.0 * math.log2(_pitch(sound, STRUCK_S + begin_s, STRUCK_S + end_s) / F01_HZ)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("key", "name", "own", "wanted"), IN_BOTH)
def test_a_hard_stroke_glides_as_far_as_was_set_and_a_soft_one_keeps_its_pitch(
    kind: str, key: str, name: str, own: float, wanted: float
) -> None:
    scene, change = _scene(kind, **{key: own}), LiveChange(0.05, name, wanted)
    before, after = _cents(_sound(scene, FULL)), _cents(_sound(scene, FULL, change))
    assert after == pytest.approx(_cents(_sound(_scene(kind, **{key: wanted}), FULL)), abs=0.1)
    assert after > 5.0 * before > 0.0
    for changes in ((), (change,)):
        assert _cents(_sound(scene, SOFT, *changes), 0.0, 0.5) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize(("key", "name", "own", "wanted"), IN_BOTH)
def test_only_the_one_that_counts_is_a_parameter(key: str, name: str, own: float, wanted: float) -> None:
    scene = _scene("mesh", **{key: own})
    other = {"tension.glide": "tension.young", "tension.young": "tension.glide"}[name]
    rows = {row: table_of(scene)[row].quantity for row in table_of(scene) if row.startswith("tension.")}
    assert list(rows) == [name]
    assert rows[name].rebuilds
    assert (scene_values(scene)[name], rebuilt_values(scene)[name]) == (own, own)
    changed = scene_with(scene, {name: wanted})
    assert getattr(changed.drum.effects["tension"], key) == wanted
    assert scene_rebuilt(scene, {name: wanted, other: 1.0}) == changed
    with pytest.raises(Refusal, match=rf"{other}: no such parameter in this scene; it has .*{name}"):
        scene_with(scene, {other: 1.0})


def test_a_drum_without_tension_has_neither() -> None:
    plain = Scene("plain")
    assert not [name for name in table_of(plain) if name.startswith("tension.")]
    assert scene_rebuilt(plain, {"tension.glide": 90.0, "tension.young": 3.0}) == plain


@pytest.mark.parametrize("own", [0.002, 5.2])
def test_a_heads_stiffness_is_never_set_to_0_where_the_cents_would_count(own: float) -> None:
    scene = _scene("mesh", young_GPa=own)
    row = table_of(scene)["tension.young"]
    assert (row.quantity.low, row.quantity.high) == (min(own, 0.01), 50.0)
    assert row.from_norm(row.norm(own)) == pytest.approx(own)
    with pytest.raises(Refusal, match=r"tension\.young: 0 GPa is outside 0\.0.* \.\. 50 GPa"):
        scene_with(scene, {"tension.young": 0.0})
    law = law_of(scene)
    assert within(fence_of(scene), law.view(np.int64), law.view(np.float64))


def test_the_shipped_toms_offer_their_heads_stiffness() -> None:
    for name in ("tom", "low-tom", "mid-tom", "high-tom"):
        rows = table_of(parse(shipped_text(name), name))
        assert "tension.young" in rows
        assert "tension.glide" not in rows
