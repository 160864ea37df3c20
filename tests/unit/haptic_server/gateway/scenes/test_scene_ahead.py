"""The scene that is made ready while another plays, as the gateway sees it in the run folder."""

import time
from pathlib import Path

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import files
from haptic_server.gateway.link import warm_up
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.scenes.requests import SceneRequests
from osc_bench import BOUND_S


def laid_out(run: Path, name: str) -> None:
    (run / files.NEXT).mkdir()
    (run / files.NEXT / files.SCENE).write_text(shipped_text(name))


def wait_until(path: Path) -> None:
    end = time.monotonic() + BOUND_S
    while not path.exists():
        assert time.monotonic() < end
        time.sleep(0.01)


def named(ahead: SceneAhead) -> str:
    end = time.monotonic() + BOUND_S
    while not ahead.name and time.monotonic() < end:
        time.sleep(0.01)
    return ahead.name


def test_it_is_told_at_once_and_loaded_when_its_servo_has_compiled(tmp_path: Path) -> None:
    ahead = SceneAhead(tmp_path, shipped_text("roll"))
    assert (ahead.look(), ahead.name, ahead.tables) == ("", "", None)
    laid_out(tmp_path, "tom")
    ahead.look()
    assert named(ahead) == "tom"
    assert ahead.tables is not None
    assert ahead.tables["name"] == "tom"
    assert not (tmp_path / files.NEXT / files.GATEWAY_READY).exists()
    warm_up(law_of(parse(shipped_text("tom"), "tom.toml")))  # what compiles, compiles before
    (tmp_path / files.NEXT / files.SERVO_READY).touch()
    wait_until(tmp_path / files.NEXT / files.GATEWAY_READY)


def test_one_that_is_taken_away_is_told_no_longer(tmp_path: Path) -> None:
    ahead = SceneAhead(tmp_path, shipped_text("roll"))
    laid_out(tmp_path, "tom")
    ahead.look()
    assert named(ahead) == "tom"
    (tmp_path / files.NEXT).rename(tmp_path / "elsewhere")
    ahead.look()
    assert ahead.name == ""


def test_a_refusal_is_told_once_and_kept_until_the_next_wish(tmp_path: Path) -> None:
    requests = SceneRequests(tmp_path, True, lambda _claim: None)
    ahead = SceneAhead(tmp_path, shipped_text("roll"), requests.take_refusal)
    (tmp_path / files.REFUSED).write_text("too hard")
    assert [ahead.look(), ahead.look(), ahead.refusal] == ["too hard", "", "too hard"]
    laid_out(tmp_path, "tom")
    ahead.look()
    assert ahead.refusal == ""


def test_it_has_come_when_another_scene_lies_there_than_ours(tmp_path: Path) -> None:
    ahead = SceneAhead(tmp_path, shipped_text("roll"))
    assert not ahead.has_come()  # nothing to read
    (tmp_path / files.SCENE).write_text(shipped_text("roll"))
    assert not ahead.has_come()
    (tmp_path / files.SCENE).write_text(shipped_text("tom"))
    assert ahead.has_come()
