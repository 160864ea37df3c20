"""The picture's camera: drum and stick are whole in every shape of window."""

import math

import numpy as np
import pytest

from web_panel.page.picture_camera import camera_for
from web_panel.rig.stick_shape import grip_of, stick_shape


@pytest.mark.parametrize("aspect", [0.18, 0.5, 676 / 800, 1.0, 752 / 1080, 2.5])
@pytest.mark.parametrize("radius_m", [0.1016, 0.127, 0.1778, 0.2794])
def test_the_end_of_the_stick_and_the_rim_are_in_view(aspect: float, radius_m: float) -> None:
    eye, look_at = (np.array(point) for point in camera_for(aspect, radius_m))
    forward = (look_at - eye) / np.linalg.norm(look_at - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    tip = (0.3, 0.2, 0.05)
    grip = grip_of(tip, 0.0, radius_m)
    butt = np.array(tip) + stick_shape(radius_m).butt[-1][0] / math.dist(tip, grip) * np.subtract(grip, tip)
    for point in (butt, (-1.07, 0, 0), (1.07, 0, 0), (0, 1.07, 0), (0, -1.04, -0.54), tip):
        seen = np.asarray(point) - eye
        far = seen @ forward
        assert far > 0.0
        assert abs(seen @ up) <= far * math.tan(math.radians(37.5))
        assert abs(seen @ right) <= aspect * far * math.tan(math.radians(37.5))


def test_a_window_of_nearly_the_same_shape_leaves_the_picture_as_it_is_turned() -> None:
    assert camera_for(0.845, 0.1778) == camera_for(0.8451, 0.1778)
