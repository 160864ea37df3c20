"""A scene whose drum cannot be computed: said once, and the drum of the scene before goes on."""

import logging

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from playing_drum import Link, Sink, drum_of

# The losses leave nothing of a wave after one step.
LOSSY = "[drum]\nf01_Hz = 150.0\n[drum.effects.internal_loss]\nt60_s = 0.001\nat_Hz = 400.0\n"


def test_a_drum_goes_on_with_the_scene_before(caplog: pytest.LogCaptureFixture) -> None:
    roll, bad = parse(shipped_text("roll"), "roll.toml"), parse(LOSSY, "loss.toml")
    link = Link(bad)
    drum = drum_of(link, Sink())
    with caplog.at_level(logging.ERROR):
        assert not drum._catch_up()
        assert not drum._catch_up()
    assert len(caplog.messages) == 1
    assert "loss cannot be computed" in caplog.messages[0]
    link.playing = roll
    assert drum._catch_up()
    engine = drum._engine
    assert engine is not None
    link.playing = bad
    assert drum._catch_up()
    assert drum._engine is engine
    link.playing = roll
    assert drum._catch_up()
    assert drum._engine is engine
