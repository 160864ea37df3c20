"""Replacement of a sounding drum by another one of the same scene, for values that it cannot take up while it sounds.

The other drum is built beside it; strikes go there when it is ready, and the one before rings on for a while. So a set
is heard as late as its drum takes to build, and never sooner than the last replaced one is silent: a rig has two drums
at most. Of what is set meanwhile the newest counts. All methods belong to the drum's thread.
"""

import logging
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from drumstick.drum.build import Unplayable
from drumstick.drum.engine import Engine
from drumstick.drum.fitting import Fit
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.fade import FADE_S, RINGS_ON_S
from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
from drumstick.parameters.scene import Scene
from sound_server.mixer import MixerFull

_BESIDE_S = 0.15  # beyond a fade: blocks, and turns of the drum's thread
_FULL_S = 1.0  # until a full mixer is asked again


class MadeDrum(NamedTuple):
    """A drum that can be entered: the scene that it was made of, its mesh, its engine and the ring of its strikes."""

    scene: Scene
    fit: Fit
    engine: Engine
    ring: StrikeRing


class Replacement:
    """`make(scene, original)` builds a drum of a scene that differs from the original in values, seconds; raises
    Unplayable. `enter(made)` lets it take the sounding one's place; raises MixerFull. `report()` is called when
    `waiting` has changed and something slow begins."""

    def __init__(
        self,
        make: Callable[[Scene, Scene], MadeDrum],
        enter: Callable[[MadeDrum], None],
        report: Callable[[], None],
    ) -> None:
        self._make, self._enter, self._report = make, enter, report
        self._scene: Scene | None = None
        self._waits_s = 0.0
        self._sounding: dict[str, float] = {}
        self._wanted: dict[str, float] = {}
        self._made: MadeDrum | None = None
        self._next_at = 0.0
        self.waiting = ""  # what is set and does not sound, in words

    def play(self, scene: Scene, waits_s: float) -> None:
        """A drum of this scene, with its own values, sounds now; strikes may wait for so long until they sound."""
        self._scene, self._waits_s = scene, waits_s
        self._sounding = rebuilt_values(scene)
        self._wanted, self._made, self.waiting = self._sounding, None, ""

    def step(self, heard: Mapping[str, float], may_enter: bool) -> bool:
        """Build and enter what `heard`, values by wire name, asks for; True when all of it sounds. Seconds, while it
        builds. `may_enter`: False while a force presses on the sounding drum, for one contact goes to one drum.
        """
        wanted = {name: heard.get(name, value) for name, value in self._sounding.items()}
        if wanted == self._sounding:
            self._wanted, self._made, self.waiting = wanted, None, ""
            return True
        if time.monotonic() < self._next_at:
            return False
        if wanted != self._wanted:
            self._build(wanted)
        if self._made is not None and may_enter:
            self._take_place(self._made)
        return wanted == self._sounding

    def _build(self, wanted: dict[str, float]) -> None:
        assert self._scene is not None
        named = ", ".join(
            f"{name} {value:g}" for name, value in wanted.items() if value != self._sounding[name]
        )
        self._wanted, self._made, self.waiting = wanted, None, f"building a drum of {named}"
        self._report()
        try:
            self._made = self._make(scene_rebuilt(self._scene, wanted), self._scene)
        except Unplayable as error:
            self.waiting = f"no drum of {named}: {error}"
            logging.error("%s", self.waiting)

    def _take_place(self, made: MadeDrum) -> None:
        try:
            self._enter(made)
        except MixerFull as error:
            self.waiting = f"a drum is built, but {error}"
            self._next_at = time.monotonic() + _FULL_S
            return
        self._sounding, self._made, self.waiting = self._wanted, None, ""
        self._next_at = time.monotonic() + self._waits_s + RINGS_ON_S + FADE_S + _BESIDE_S
