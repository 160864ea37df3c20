"""Air and kettle on a bank of modes, under tension and under mallets: no step makes energy."""

import dataclasses
import math

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from drumstick.drum.build import Unplayable, new_engine
from drumstick.drum.effects.air import AirTable
from drumstick.drum.effects.kettle import KettleTable
from drumstick.drum.effects.tension import TensionTable
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.parameters.drum import Modal
from drumstick.parameters.mallet import MATERIALS
from mallets import joules, start_mallet, with_mallet
from stability.mesh_steps import RATE, drum_of, take

ROUNDING = 2e-6  # of the largest energy, in a step: float32's
AIR = st.builds(AirTable, st.floats(0.1, 10.0), st.floats(0.05, 2.0), st.sampled_from(["endless", "none"]))


@pytest.mark.daily("under tension")
@pytest.mark.parametrize("is_tense", [False, True], ids=["slack", "under tension"])
@settings(max_examples=3)
@given(
    AIR,
    st.none() | st.builds(KettleTable, st.floats(0.05, 2.0)),
    st.floats(0.05, 0.6),
    st.floats(40.0, 200.0),
    st.floats(1.0, 10.0),
    st.sampled_from(sorted(MATERIALS)),
    st.lists(st.tuples(st.floats(1.0, 20.0), st.floats(-0.8, 0.8)), min_size=2, max_size=4),
)
def test_no_mallet_on_a_bank_in_air_makes_energy(
    is_tense: bool,
    air: AirTable,
    kettle: KettleTable | None,
    radius_m: float,
    f01_Hz: float,
    young_GPa: float,
    material: str,
    strokes: list[tuple[float, float]],
) -> None:
    """Any air and bowl; strokes before the last ones are over, m/s and place. What radiates takes a part."""
    effects: dict[str, object] = {"air": air}
    if kettle is not None:
        effects["kettle"] = kettle
    if is_tense:
        effects["tension"] = TensionTable(young_GPa=young_GPa, thickness_mm=0.2, most_cents=1200.0)
    scene = dataclasses.replace(
        drum_of(effects, math.inf, f01_Hz, radius_m=radius_m), modal=Modal(5.0 * f01_Hz)
    )
    try:
        engine = new_engine(with_mallet(scene, material=material, **MATERIALS[material]), RATE, StrikeRing())
    except Unplayable as refusal:
        assert "f01_Hz" in str(refusal), refusal
        reject()
    assert engine.mallets is not None
    largest, lost, pulled = 0.0, 0.0, False
    for speed, x in strokes:
        start_mallet(engine, speed, x, 0.1)
        take(engine, 1)  # it arrives, with what it has
        held = joules(engine)
        largest = max(largest, held)
        for _ in range(40):
            take(engine, 1)
            now = joules(engine)
            assert 0.0 <= now <= held + ROUNDING * largest
            lost, held = lost + held - now, now
            pulled = pulled or (is_tense and float(engine.effects.tension.state["pull"][0]) > 0.0)
    assert lost > 0.0
    assert pulled == is_tense
