"""The page has the controls of the values that its scene has, and no others."""

import pytest
from fake_rig import FakeRig
from panel_process import PanelProcess

from drumstick_lab.benchmarks.scenes.drawn import drawn_on

pytestmark = pytest.mark.system


def test_a_visitor_gets_controls_of_what_the_scene_has_and_no_others(
    faked: FakeRig, served: PanelProcess
) -> None:
    faked.begin_again()
    drawn = drawn_on(served.port, served.cookie, 0.2)
    assert drawn.values == sorted({*faked.table, "rate", "level"})
    assert "gamma" not in faked.table  # another effect's
    assert drawn.controls > len(drawn.values)  # PANIC and buttons besides
    assert (drawn.plots, drawn.nodes) > (0, 3)
