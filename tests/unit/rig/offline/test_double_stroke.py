"""A scene of two sticks: what `drumstick analyse` tells of it, and that nothing live plays it."""

import json
from pathlib import Path

import pytest

import drumstick as ds
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.device.selection import chosen
from rig import scene_file
from rig.exit_status import CommandError
from rig.offline import analyse as told

SCENE = parse(shipped_text("double-stroke"), "double-stroke")


def test_analyse_tells_rate_evenness_and_work(capsys: pytest.CaptureFixture[str]) -> None:
    told.analyse("double-stroke", True)
    work = json.loads(capsys.readouterr().out)["hand_work"]
    assert work["rate_Hz"] == pytest.approx(16.0, rel=1e-3)
    assert len(work["hands_W"]) == 2
    told.analyse("double-stroke", False)
    assert "the hands give 12.8 mW, 12.8 mW; the drum gives 0 mW" in capsys.readouterr().out


def test_hands_that_play_no_roll_are_told_so(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Lifted so little, the sticks stay in the head."""
    path = tmp_path / "low.toml"
    path.write_text(
        shipped_text("double-stroke").replace("gesture_height_m = 0.018", "gesture_height_m = 0.001")
    )
    told.analyse(str(path), False)
    assert "the hands play no roll" in capsys.readouterr().out


def test_nothing_live_plays_two_sticks() -> None:
    """Each way in says so, and no other shipped scene is kept out."""
    with pytest.raises(DeviceError, match="the servo plays one stick"):
        chosen("simulated", SCENE)
    with pytest.raises(ValueError, match="the servo plays one stick"):
        ds.servo(SCENE, 1.0)
    with pytest.raises(CommandError, match="the servo plays one stick"):
        scene_file.scene_files("double-stroke", lambda _: None)
    others = [name for name in shipped_names() if parse(shipped_text(name), name).hand.why_not_live]
    assert others == ["double-stroke"]
