"""Costs beside other instruments' meshes are judged by the median of rounds, theirs and ours alike."""

import pytest

from drumstick_lab.benchmarks.sound import mesh_peers
from drumstick_lab.benchmarks.sound.mesh_peers import Cost, cost_of, ratios


def test_a_score_costs_what_it_takes_beyond_the_empty_one_of_the_same_round() -> None:
    cost = cost_of([50.0, 90.0, 70.0], [10.0, 30.0, 10.0], 10)
    assert cost.rounds == [4.0, 6.0, 6.0]
    assert cost.best == 4.0
    assert cost.row() == {"ns": 4.0, "ns_median": 6.0, "ns_band": (4.0, 6.0)}


def test_one_lucky_run_of_either_side_decides_nothing() -> None:
    theirs = Cost([10.0] * 19 + [1.0], 1.0)
    ours = Cost([1.0] * 18 + [0.1, 1.0], 0.1)
    found = ratios({"theirs": theirs, "ours N = 32": ours}, ["theirs"], ["ours N = 32"])["ours N = 32"][
        "theirs"
    ]
    assert found == {"median": 10.0, "band": (10.0, 10.0), "of_bests": pytest.approx(10.0)}


def test_goals_are_missed_by_medians() -> None:
    row = {"STK Mesh2D": {"median": 7.9, "of_bests": 12.0}, "SuperCollider MembraneCircle": {"median": 25.0}}
    assert mesh_peers.below({"ours N = 64": row}) == [
        "ours N = 64: STK Mesh2D should cost 8.0 times as much, not 7.9"
    ]


def test_too_few_rounds_to_be_stored_are_told_beforehand(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mesh_peers, "missing", lambda: ["libstk-dev", "faust"])
    with pytest.raises(SystemExit) as ended:
        mesh_peers.main(["--rounds", "3"])
    assert "sudo apt-get install libjack-jackd2-dev libstk-dev faust" in str(ended.value)
    assert "3 rounds: nothing will be stored; 15 are needed" in capsys.readouterr().out
