"""The head and the stick, seen from the player's side, in true proportion: lengths are in radii of the head."""

import math

import numpy as np
import viser

from drumstick.scene import Scene
from protocol.messages import State, Strike
from web_panel.mirror import Mirror

# From the tip towards the player's right hand: a unit vector, and the turn that takes +z there.
_AIM = np.array((0.62, -0.55, 0.56)) / math.hypot(0.62, -0.55, 0.56)
_TURN = np.array((1.0 + _AIM[2], -_AIM[1], _AIM[0], 0.0)) / math.sqrt(2.0 * (1.0 + _AIM[2]))
_LENGTH = 1.2


class DrumView:
    """A picture; nothing in it can be touched. Main thread."""

    def __init__(self, server: viser.ViserServer) -> None:
        scene = server.scene
        scene.configure_default_lights(True, cast_shadow=False)
        # Without a graphics card this picture is the page's burden: with viser's environment map and shadows a click
        # took ten times as long.
        scene.configure_environment_map(None)
        scene.add_light_ambient("/daylight", intensity=0.9)
        server.initial_camera.position = (0.0, -2.3, 1.7)
        server.initial_camera.look_at = (0.0, 0.0, -0.1)
        scene.add_cylinder(
            "/shell",
            1.04,
            0.5,
            (92, 34, 30),
            material="toon3",
            cast_shadow=False,
            receive_shadow=False,
            radial_segments=96,
            position=(0.0, 0.0, -0.29),
        )
        scene.add_cylinder(
            "/hoop",
            1.07,
            0.09,
            (150, 152, 158),
            material="toon3",
            cast_shadow=False,
            receive_shadow=False,
            radial_segments=96,
            position=(0.0, 0.0, -0.045),
        )
        scene.add_cylinder(
            "/head",
            1.0,
            0.02,
            (228, 222, 206),
            material="toon3",
            cast_shadow=False,
            receive_shadow=False,
            radial_segments=96,
            position=(0.0, 0.0, -0.01 + 0.004),
        )
        self._spot = scene.add_cylinder(
            "/spot",
            1.0,
            0.004,
            (242, 150, 40),
            material="toon3",
            cast_shadow=False,
            receive_shadow=False,
            radial_segments=48,
            position=(0.0, 0.0, 0.006),
            visible=False,
        )
        self._stick = scene.add_frame("/stick", show_axes=False, position=(0.0, 0.0, 0.5))
        scene.add_icosphere("/stick/tip", 0.045, (245, 215, 160))
        scene.add_cylinder(
            "/stick/shaft", 0.03, _LENGTH, (240, 200, 140), wxyz=_TURN, position=0.5 * _LENGTH * _AIM
        )
        self._strike: Strike | None = None

    def show(self, mirror: Mirror) -> None:
        """Move the stick to where the servo last said it is, and mark the last strike."""
        if mirror.state is None or mirror.scene is None:
            return
        self._place(mirror.state, mirror.scene)
        if mirror.strike is not None and mirror.strike is not self._strike:
            self._strike = mirror.strike
            self._spot.visible = True
            self._spot.position = np.array((mirror.strike.x, mirror.strike.y, 0.006))
            self._spot.scale = 0.05 + 0.2 * mirror.strike.level

    def _place(self, state: State, scene: Scene) -> None:
        z = min(max(state.z_m / scene.drum.radius_m, -0.5), 3.0)
        place = np.array((state.x, state.y, 0.045 + z))
        if np.max(np.abs(place - self._stick.position)) > 1e-4:
            self._stick.position = place
