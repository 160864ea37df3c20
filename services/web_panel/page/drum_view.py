"""The head and the stick, seen from the player's side: lengths are in radii of the head, true but for the head's own.

The stick stands where the servo last said; the head moves as the sound server computes it, exaggerated by a factor
that the picture states.
"""

import numpy as np
import viser

from protocol.messages import Membrane, State
from web_panel.page.strike_marks import StrikeMarks
from web_panel.page.wording import figure
from web_panel.rig.rig_state import RigState
from web_panel.rig.stick_shape import grip_of, height_of, stick_shape
from web_panel.rig.surface_mesh import Corners, Exaggeration, disc, heights_of, hoop, revolved, tallness

_STICK = {"tip": (245, 225, 180), "shaft": (240, 200, 140), "grip": (30, 90, 128), "butt": (190, 130, 70)}
_SILENT = "no sound server"
_AT_REST = (16, 48)  # rings and spokes before any surface was heard


class DrumView:
    """A picture; nothing in it can be touched. Main thread."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = scene = server.scene
        scene.configure_default_lights(False)
        # From low at the side: a slope of the head looks brighter or darker.
        scene.add_light_directional("/sun", intensity=2.4, cast_shadow=False, position=(-2.0, -0.7, 0.9))
        # Without a graphics card this picture is the page's burden: with viser's environment map and shadows a click
        # took ten times as long.
        scene.configure_environment_map(None)
        scene.add_light_ambient("/daylight", intensity=1.0)
        server.initial_camera.position = (0.42, -3.4, 2.3)
        server.initial_camera.look_at = (0.42, -0.2, -0.1)
        self._add_solid("/shell", *hoop(0.99, 1.04, -0.54, -0.04), (150, 52, 44))
        self._add_solid("/hoop", *hoop(1.0, 1.07, -0.09, 0.0), (150, 152, 158))
        self._spread = _AT_REST
        self._corners, self._head = self._new_head()
        self._exaggeration = Exaggeration()
        self._label = scene.add_label("/label", _SILENT, position=(0.0, -1.07, -0.62), anchor="top-center")
        self._shown: Membrane | None = None
        self._spots = StrikeMarks(scene)
        self._stick = scene.add_frame("/stick", show_axes=False, position=(0.0, 0.0, 0.5))
        self._radius_m = 0.0  # of the head beside which the stick was made

    def _add_solid(
        self, name: str, corners: Corners, faces: np.ndarray, colour: tuple[int, int, int]
    ) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            name, corners, faces, color=colour, side="double", cast_shadow=False, receive_shadow=False
        )

    def _new_head(self) -> tuple[Corners, viser.MeshHandle]:
        corners, faces = disc(*self._spread)
        return corners, self._add_solid("/head", corners, faces, (214, 205, 184))

    def show(self, rig_state: RigState, now: float) -> None:
        """Move the stick to where the servo last said it is, the head, and the marks of the last strikes."""
        if rig_state.state is None or rig_state.scene is None:
            return
        self._place(rig_state.state, rig_state.scene.drum.radius_m, rig_state.z_h0_m)
        if rig_state.membrane is not self._shown:
            self._shown = rig_state.membrane
            self._move(rig_state.membrane, rig_state.scene.drum.radius_m, now)
        self._spots.show(rig_state.new_strikes, self._height_at, now)

    def _place(self, state: State, radius_m: float, z_h0_m: float) -> None:
        if radius_m != self._radius_m:
            self._radius_m, self._shape = radius_m, stick_shape(radius_m)
            for name, colour in _STICK.items():
                self._add_solid(f"/stick/{name}", *revolved(getattr(self._shape, name), 24), colour)
        tip = (state.x, state.y, height_of(state.z_m, radius_m))
        place, turn = self._shape.pose(tip, grip_of(tip, z_h0_m, radius_m))
        if np.max(np.abs(np.subtract(place, self._stick.position))) > 1e-4:
            self._stick.position, self._stick.wxyz = place, turn

    def _move(self, surface: Membrane | None, radius_m: float, now: float) -> None:
        if surface is None:
            self._corners[:, 2] = 0.0
            self._head.vertices = self._corners
            self._say(_SILENT)
            return
        heights = heights_of(surface)
        if (surface.rings, surface.spokes) != self._spread:
            self._spread = surface.rings, surface.spokes
            self._corners, self._head = self._new_head()
        times = self._exaggeration.of(tallness(heights), radius_m, now)
        self._corners[: len(heights), 2] = heights * (times / radius_m)
        self._head.vertices = self._corners
        self._say(f"head’s movement drawn ×{figure(times)}")

    def _say(self, words: str) -> None:
        if words != self._label.text:
            self._label.text = words

    def _height_at(self, x: float, y: float) -> float:
        # Of the picture, at the corner next to (x, y).
        apart = np.abs(self._corners[:, 0] - x) + np.abs(self._corners[:, 1] - y)
        return float(self._corners[int(np.argmin(apart)), 2])
