"""Scenes whose effects are each in range, and leave a wave no room together: refused in words."""

from pathlib import Path

import pytest

from drumstick.drum import fitting
from drumstick.drum.build import Unplayable, new_engine
from drumstick.drum.calibrate import build
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse
from realtime.kernels import cache_files

RATE_HZ = 48_000
STIFF_AIR = (
    "[drum]\nf01_Hz = 60.0\n[mesh]\n{mesh}\n"
    "[drum.effects.cavity]\ndepth_m = 0.02\nhead_kg_per_m2 = 0.05\nf01_Hz = 60.0\n"
)
# Each with the reason.
REASONS = {
    "loss": "the losses leave nothing of a wave after one step",
    "air": "nothing is left of the stiffness of the lowest mode",
    "square": "junctions 0.56.* radii apart: the mesh takes",
}
TEXTS = {
    "loss": "[drum]\nf01_Hz = 150.0\n[drum.effects.internal_loss]\nt60_s = 0.001\nat_Hz = 400.0\n",
    "air": STIFF_AIR.format(mesh="rate_Hz = 4000.0"),
    "square": '[drum]\nf01_Hz = 2000.0\n[mesh]\ntopology = "rectilinear"\n'
    "[drum.effects.internal_loss]\nt60_s = 0.001\nat_Hz = 4000.0\n[drum.effects.tension]\nglide_cents = 600.0\n",
}


@pytest.mark.parametrize("name", TEXTS)
def test_it_is_said_with_its_name_its_effects_and_what_to_do(name: str) -> None:
    with pytest.raises(
        Unplayable,
        match=rf"{name} cannot be computed at 48000 Hz with .*{REASONS[name]}.*: make the effects weaker",
    ):
        new_engine(parse(TEXTS[name], f"{name}.toml"), RATE_HZ, StrikeRing())


def test_auto_passes_over_meshes_that_cannot_be() -> None:
    scene = parse(STIFF_AIR.format(mesh='accuracy = "auto"\ncpu_budget = 0.01'), "air.toml")
    build(scene, RATE_HZ, StrikeRing())
    assert fitted(scene, RATE_HZ).scene.mesh.rate_Hz > 4000.0


def test_auto_does_not_count_a_cheaper_mesh_that_cannot_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every mesh is in tune, and all that are duller than standard leave a wave no room: brightness does not bind."""
    monkeypatch.setattr(cache_files, "folder_of", lambda _module: tmp_path)
    monkeypatch.setattr(fitting, "_measured", lambda _found, _rate_Hz: fitting.CostModel(20.0, 0.2))
    lossy = (
        '[drum]\nf01_Hz = 150.0\n[mesh]\naccuracy = "auto"\nauto_jnd = 10.0\n'
        "[drum.effects.internal_loss]\nt60_s = 0.002\nat_Hz = 400.0\n"
    )
    assert "pitch binds" in fitted(parse(lossy, "lossy.toml"), RATE_HZ).note


def test_auto_says_what_air_leaves_no_tension_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before any mesh is tried: its candidates' pitch on a mesh is that of the head in air."""
    monkeypatch.setattr(fitting, "_measured", lambda _found, _rate_Hz: pytest.fail("a mesh was tried"))
    stiff = '[drum]\nf01_Hz = 60.0\n[mesh]\naccuracy = "auto"\n[drum.effects.air]\nbending_N_m = 10.0\n'
    with pytest.raises(Unplayable, match=r"drum of stiff cannot be computed at 48000 Hz \(without tension"):
        fitted(parse(stiff, "stiff.toml"), RATE_HZ)
