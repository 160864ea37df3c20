"""The stick's part of `drumstick accuracy`: every row has every key, and JSON can tell it."""

import dataclasses
import json
import math
from typing import Any

import pytest

import sundae_stand_in
from drumstick.stick.methods.carry import ORDERS, STEPPERS
from drumstick_lab.accuracy import stick
from drumstick_lab.accuracy.stick import PEER, PEERS, Sweep
from drumstick_lab.accuracy.timing import CHAIN

KEYS = {
    "method", "locates", "dt_s", "rtol", "ns_per_s", "median_ns", "ratio", "error_contacts", "error_v_lc", "error_rate",
    "missed",
}  # fmt: skip
FEW = (
    Sweep("rk4", True, (1e-3, 3e-4)),
    Sweep("rk4", False, (1e-3,)),
    Sweep("verlet", True, (0.01,)),  # at which the roll dies
    *(Sweep(peer, True, (1e-3,)) for peer in PEERS),
)


@pytest.fixture
def sundae(monkeypatch: pytest.MonkeyPatch) -> None:
    """scikit-sundae, which nothing but two rows needs, or what stands in for it."""
    sundae_stand_in.install(monkeypatch)
    monkeypatch.setattr(stick, "version", lambda name: f"{name}'s")  # pyright: ignore[reportUnknownLambdaType]


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few short windows: this is not about the figures."""
    for name, value in {"QUICK": FEW, "QUICK_ROUNDS": 1, "_STEPS_A_WINDOW": 1000}.items():
        monkeypatch.setattr(stick, name, value)


def _found() -> dict[str, Any]:
    found: dict[str, Any] = {}
    for job in stick.jobs(True, found):
        assert job.words.startswith("stick: ")
        job.run()
    return json.loads(json.dumps(found, allow_nan=False))


@pytest.mark.usefixtures("tiny", "sundae")
def test_a_row_for_each_step_and_tolerance() -> None:
    found = _found()
    assert set(found) == {"scene", "orders", "exact_error", "rows", "peers", "yardstick_ns"}
    assert found["peers"]["CVODE, Adams"] == "scikit-sundae scikit-sundae's"
    assert found["scene"] == "roll"
    assert found["orders"] == ORDERS
    assert all(set(row) == KEYS for row in found["rows"])
    told = [(row["method"], row["locates"], row["dt_s"], row["rtol"]) for row in found["rows"]]
    assert told == [
        ("exact", True, None, None),
        ("rk4", True, 1e-3, None),
        ("rk4", True, 3e-4, None),
        ("rk4", False, 1e-3, None),
        ("verlet", True, 0.01, None),
        *((peer, True, None, 1e-3) for peer in PEERS),
    ]
    for row in found["rows"]:
        assert math.isfinite(row["ns_per_s"])
        assert min(row["ns_per_s"], row["ratio"]) > 0.0
        assert row["ns_per_s"] <= row["median_ns"][0] <= row["median_ns"][1]
        assert row["ns_per_s"] / row["ratio"] == pytest.approx(
            found["yardstick_ns"][CHAIN]
        )  # one set of rounds


@pytest.mark.usefixtures("tiny", "sundae")
def test_errors_are_null_only_where_the_roll_was_missed() -> None:
    exact, coarse, finer, naive, dead, *peers = _found()["rows"]
    errors = ("error_contacts", "error_v_lc", "error_rate")
    assert [exact[name] for name in errors] == [0.0, 0.0, 0.0]
    assert [dead[name] for name in errors] == [None, None, None]
    assert dead["missed"]
    for row in (exact, coarse, finer, naive, *peers):
        assert not row["missed"]
    for name in errors:
        assert 0.0 < finer[name] < coarse[name] < naive[name]
        assert all(0.0 < peer[name] < 5e-2 for peer in peers)  # the real CVODE at a tolerance of 1e-3: 3e-2


@pytest.mark.usefixtures("tiny")
def test_of_a_peer_that_is_not_there_a_sentence_takes_the_rows_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stick, "find_spec", lambda name: None)  # pyright: ignore[reportUnknownLambdaType]
    found = _found()
    assert found["peers"][PEER] == "not installed: pip install haptic-drumstick[sound]"
    assert found["peers"]["CVODE, BDF"] == "not installed: pip install scikit-sundae"
    assert {row["method"] for row in found["rows"]} == {"exact", "rk4", "verlet"}


def test_the_full_sweep_has_every_method_and_the_quick_one_steps_of_it() -> None:
    full = {(sweep.method, sweep.locates): set(sweep.sizes) for sweep in stick.FULL}
    assert set(full) == {(method, locates) for method in STEPPERS for locates in (True, False)} | {
        (peer, True) for peer in PEERS
    }
    quick = {(sweep.method, sweep.locates): set(sweep.sizes) for sweep in stick.QUICK}
    assert set(full) - set(quick) == {(peer, True) for peer in PEERS if peer != PEER}
    assert all(sizes <= full[key] for key, sizes in quick.items())


@pytest.mark.usefixtures("sundae")
@pytest.mark.parametrize("release", ["paper", "unilateral"])
@pytest.mark.parametrize("trigger", ["entry", "turn", "exit"])
def test_cvode_is_asked_for_the_same_events_as_scipy(release: str, trigger: str) -> None:
    from drumstick_lab.accuracy.sticks.cvode_stick import CvodeCase
    from drumstick_lab.accuracy.sticks.solve_ivp_stick import Case, played

    roll = stick.Roll().scene
    scene = dataclasses.replace(
        roll,
        stick=dataclasses.replace(roll.stick, release=release),
        effects={"pulse": dataclasses.replace(roll.effects["pulse"], trigger=trigger)},
    )
    theirs = played(CvodeCase(scene, 1e-10, 1e-12, "Adams"), 4, 0.4)
    scipys = played(Case(scene, 1e-10, 1e-12), 4, 0.4)
    assert theirs.contacts == pytest.approx(scipys.contacts, rel=1e-6)
    assert [each[:3] for each in theirs.stretches] == [each[:3] for each in scipys.stretches]
