"""Rows of stage `wire` have what is stored; memory, latency and decay of a drum are those of its arrays."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick.perception import jnd
from drumstick_lab.accuracy import wire
from drumstick_lab.accuracy.drums import footprint
from drumstick_lab.accuracy.drums.heads import decay_off


def times(p50: float, p1: float, p99: float) -> dict[str, float]:
    return {"p1": p1, "p50": p50, "p99": p99}


def test_a_row_has_the_median_and_half_of_what_lies_between_the_hundredths() -> None:
    at_once: dict[str, Any] = {"latency_ms": 0.0, "sound_ms": times(2.0, 1.0, 3.2)}
    at_once |= {"osc_ms": times(0.7, 0.1, 1.3), "zenoh_ms": times(0.8, 0.2, 1.4)}
    later = at_once | {"latency_ms": 4.0, "sound_ms": times(4.3, 4.2, 4.4)}
    latency = {
        "tick_ms": 1.0,
        "block": 64,
        "rows": {"at_once": at_once, "later": later, "streamed": at_once},
    }
    streams = {
        "block": 64,
        "rows": [{"rate_Hz": rate, "sound_ms": times(7.5, 7.4, 7.8)} for rate in (1e3, 4e3)],
    }
    found = list(wire.rows(latency, streams))
    assert [row["playing"] for row in found] == [wire.TO_SOUND] * 4 + [wire.TO_OTHERS] * 2
    assert (found[3]["choice"], found[3]["latency_ms"]) == ("streamed, 4000 Hz, computed", 7.5)
    assert found[3]["measures"][0]["value"] == pytest.approx(0.2)
    with pytest.raises(ValueError, match="computed in blocks of 128, measured in blocks of 64"):
        list(wire.rows(latency, streams | {"block": 128}))
    soon, equally = found[:2]
    assert [(each["what"], round(each["value"], 9), each["jnds"]) for each in soon["measures"]] == [
        ("spread of the onset", 1.1, pytest.approx(1.1e-3 / jnd.LATENCY_SPREAD_s)),
        ("latency", 2.0, pytest.approx(2e-3 / jnd.LATENCY_s)),
    ]
    assert (soon["latency_ms"], soon["latency_s"]) == (2.0, 0.0)
    assert (equally["latency_s"], equally["binds"]) == (0.004, "latency")
    assert soon["binds"] == "spread of the onset"


def test_bytes_are_those_of_each_array_once() -> None:
    one, other = np.zeros(10), np.zeros((2, 3), np.float32)
    assert footprint.bytes_of((one, (other, one[2:5]), None, 3)) == 80 + 24


def meshed(**mesh: Any) -> Scene:
    scene = Scene("drum")
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, **mesh))


def test_a_finer_mesh_takes_more_memory_and_less_time() -> None:
    coarse, fine = (meshed(rate_Hz=rate_Hz, cpu_budget=0.95) for rate_Hz in (8_000.0, 16_000.0))
    assert footprint.memory_bytes(fine, 48_000) > footprint.memory_bytes(coarse, 48_000) + 12 * 2500
    assert 0.0 < footprint.late_s(fine, 48_000) < footprint.late_s(coarse, 48_000) < 0.002


def test_a_drum_is_as_late_as_its_first_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    played = footprint.late_s(meshed(), 48_000)
    late = 48

    def later(*given: Any) -> Any:
        sound = render(*given)
        return np.concatenate([np.zeros((late, 2), np.float32), sound[:-late]])

    monkeypatch.setattr(footprint, "render", later)
    assert footprint.late_s(meshed(), 48_000) == pytest.approx(played + 1e-3)


def test_modes_of_a_mesh_decay_as_they_should() -> None:
    assert decay_off(meshed(rate_Hz=6_000.0, cpu_budget=0.95)) < 1e-3
