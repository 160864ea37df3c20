"""`drumstick analyse`: its JSON, its words, its exit status."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from drumstick.analysis.findings import analyse as findings_of
from drumstick.scenes.scene_text import parse, shipped_names
from rig import scene_file
from rig.exit_status import GIVEN, CommandError
from rig.offline import analyse as told

KEYS = {
    "scene",
    "beta_eq3",
    "beta_measured",
    "alpha",
    "capture_speed_m_per_s",
    "v_lc_eq7_m_per_s",
    "v_lc_kappa_m_per_s",
    "kappa",
    "cycles",
    "overdamped",
    "stable_ends",
    "basins",
}
CYCLE_KEYS = {"v_e_m_per_s", "rate_Hz", "apex_m", "contact_s", "multiplier", "stable", "period", "withstands"}
OVERDAMPED = """
[stick]
r_in_N_s_per_m = 40.0
release = "paper"
[effects.pulse]
"""


def _words(scene: str) -> str:
    loaded = scene_file.load(scene)
    return told.words(loaded, findings_of(loaded))


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is not JSON")


def _json(scene: str, capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    told.analyse(scene, True)
    return json.loads(capsys.readouterr().out, parse_constant=_refuse)


@pytest.mark.parametrize("scene", shipped_names())
@pytest.mark.daily("roll", "gaining-flight", "double-stroke", "bare-drum", "rejected*")
def test_every_shipped_scene_has_its_json_and_its_words(
    scene: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = _json(scene, capsys)
    assert set(found) >= KEYS
    assert found["scene"] == scene
    cycles = found["cycles"]
    assert isinstance(cycles, list)
    assert all(set(cycle) >= CYCLE_KEYS for cycle in cycles)
    assert sum(cycle["primary"] for cycle in cycles) == (1 if cycles else 0)
    told.analyse(scene, False)
    assert scene in capsys.readouterr().out


def test_the_default_roll_in_words() -> None:
    words = _words("roll")
    for line in ("dead below 0.05489 m/s", "lift the stick to re-arm", "it rolls at 23.05 Hz", "stable"):
        assert line in words
    # The three speeds side by side, and why the first is not the third.
    for number in ("0.56765 m/s", "0.667567 m/s", "0.62781 m/s"):
        assert number in words
    assert "Equation (7) takes kappa = beta" in words
    assert "at release: kappa = 1" in words


def test_a_pulse_into_the_head_needs_no_sentence_about_equation_7(tmp_path: Path) -> None:
    path = tmp_path / "into.toml"
    path.write_text(
        '[stick]\nrelease = "paper"\n[effects.pulse]\ntau_s = 1e-5\ntrigger = "entry"\nsign = -1\n', "utf-8"
    )
    assert "Equation (7) takes" not in _words(str(path))


def test_a_scene_that_never_repeats_says_so() -> None:
    words = _words("delay-drum")
    assert "system_delay: the motion never repeats" in words
    assert "no cycles" in words


def test_the_edge_between_rest_and_roll_is_named() -> None:
    words = _words("cor-roll")
    assert "2 stable ends" in words
    assert "warning: more than one stable end" in words
    assert "is broken by a strike below 0.2735 m/s: 0.614 m/s off" in words
    assert "equation (8)" in words


def test_equation_8_stands_at_each_cycle_beside_what_is_played(capsys: pytest.CaptureFixture[str]) -> None:
    """beta + gamma, the gamma that keeps a speed, and by how much the push that takes time misses the limit."""
    words = _words("cor-literal")
    assert "marginal gamma" in words
    found: Any = _json("cor-literal", capsys)
    assert found["beta_without_hand"] == pytest.approx(0.789417 + 0.34, abs=0.02)
    assert f"{found['beta_without_hand']:.5g}" in words
    assert [row["v_in_m_per_s"] for row in found["effective"]][:2] == [-0.05, -0.1]
    for cycle in found["cycles"]:
        assert f"{cycle['equation_8']['marginal_gamma']:.6g}" in words


def test_a_roll_that_nothing_breaks_has_no_warning() -> None:
    """A pulse at contact fires at the first touch: `paper-roll` is played from any strike."""
    words = _words("paper-roll")
    assert "one stable end" in words
    assert "warning" not in words
    assert "comes back after any single strike" in words


def test_what_does_not_exist_is_null(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "overdamped.toml"
    path.write_text(OVERDAMPED, "utf-8")
    found = _json(str(path), capsys)
    assert found["overdamped"] is True
    for key in ("beta_eq3", "beta_measured", "kappa", "v_lc_eq7_m_per_s", "capture_speed_m_per_s"):
        assert found[key] is None
    assert found["cycles"] == []
    assert parse(OVERDAMPED, "overdamped").stick.r_in_N_s_per_m == 40.0
    told.analyse(str(path), False)
    assert "overdamped" in capsys.readouterr().out


def test_a_scene_that_is_not_there_is_what_was_given() -> None:
    with pytest.raises(CommandError, match="no scene 'nowhere'") as stop:
        told.analyse("nowhere", True)
    assert stop.value.status == GIVEN


def test_the_command_line() -> None:
    """Exit 0 and one JSON object on stdout; exit 2 and one line on stderr."""
    command = [sys.executable, "-c", "from rig.cli.command import main; main()", "analyse"]
    good = subprocess.run([*command, "bare-drum", "--json"], capture_output=True, text=True, timeout=100)
    assert good.returncode == 0
    assert json.loads(good.stdout)["cycles"] == []
    assert good.stdout.count("\n") == 1
    bad = subprocess.run([*command, "nowhere"], capture_output=True, text=True, timeout=60)
    assert bad.returncode == GIVEN
    assert bad.stdout == ""
    assert len(bad.stderr.splitlines()) == 1


def test_rate_and_level_change_the_scene_first(capsys: pytest.CaptureFixture[str]) -> None:
    told.analyse("roll", as_json=True, rate_Hz=30.0, level=0.5)
    found = json.loads(capsys.readouterr().out)
    assert found["cycles"][0]["rate_Hz"] == pytest.approx(30.0, rel=1e-6)
    assert set(found["values"]) == {"k_hand", "z_ss", "dv_pls"}
    with pytest.raises(CommandError, match="nearest"):
        told.analyse("roll", as_json=True, rate_Hz=90.0)
