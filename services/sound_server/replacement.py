"""Replacement of a sounding drum by another one of the same scene, for values that it cannot take up while it sounds.

The other drum is built beside it, on a thread of its own, so that nothing else waits; strikes go there when it is
ready, and the one before rings on for a while. The next one is begun when that is silent, so a scene has two drums at
most. Of what is set meanwhile the newest counts. All methods belong to the drum's thread.
"""

import logging
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

from drumstick.drum.build import Unplayable
from drumstick.drum.engine import Engine
from drumstick.drum.fitting import Fit
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
from drumstick.parameters.drum import Listen
from drumstick.parameters.scene import Scene
from sound_server.mixer import MixerFull

_BESIDE_S = 0.15  # beyond a fade: blocks, and turns of the drum's thread
_FULL_S = 1.0  # until a full mixer is asked again


class MadeDrum(NamedTuple):
    """A drum that can be entered: the scene that it was made of, its mesh, its engine, the ring of its strikes, a copy
    of the engine that never sounds, the device's channels for its mix and each of its stems, and where it is heard."""

    scene: Scene
    fit: Fit
    engine: Engine
    ring: StrikeRing
    rest: Engine
    pairs: list[tuple[int, int]]
    listen: Listen


class Replacement:
    """`make(scene, original)` builds a drum of a scene that differs from the original in values, on another thread,
    seconds; raises Unplayable. `enter(made)` lets it take the sounding one's place: seconds until that is silent, None
    while a contact goes on; raises MixerFull."""

    def __init__(
        self, make: Callable[[Scene, Scene], MadeDrum], enter: Callable[[MadeDrum], float | None]
    ) -> None:
        self._make, self._enter = make, enter
        self._builder = ThreadPoolExecutor(1, "building")
        self._scene: Scene | None = None
        self._sounding: dict[str, float] = {}
        self._tried: dict[str, float] = {}  # what the newest build is of; it may have failed
        self._building: Future[MadeDrum] | None = None
        self._made: MadeDrum | None = None
        self._has_skipped = False  # since one entered last, another was built and not wanted any more
        self._next_at = 0.0
        self._words = ""
        self.waiting = ""  # what is set and does not sound, in words

    def close(self) -> None:
        """Build nothing any more; what is being built is thrown away."""
        self._builder.shutdown(wait=False, cancel_futures=True)

    def play(self, scene: Scene, silent_in_s: float) -> None:
        """A drum of this scene, with its own values, sounds now; the one before it, if there was one, is silent so
        much later. What is being built is of another scene, and never enters."""
        self._scene, self._sounding, self._tried = scene, rebuilt_values(scene), {}
        self._building = self._made = None
        self._has_skipped, self.waiting = False, ""
        self._wait(silent_in_s)

    def step(self, heard: Mapping[str, float]) -> bool:
        """Go on with what `heard`, values by wire name, asks for; True when all of it sounds."""
        wanted = {name: heard.get(name, value) for name, value in self._sounding.items()}
        self._collect()
        if wanted == self._sounding:
            self._made, self._has_skipped, self.waiting = None, False, ""
            if self._building is None:
                self._tried = {}
            return True
        if time.monotonic() >= self._next_at:
            self._go_on(wanted)
        sounds = wanted == self._sounding
        self.waiting = "" if sounds else f"drum of {self._named(wanted)}: {self._words}"
        return sounds

    def _go_on(self, wanted: dict[str, float]) -> None:
        if self._tried == wanted:
            if self._made is not None:
                self._take_place(self._made)
            return
        self._words = "being built"
        if self._building is not None:
            return
        if self._made is not None and self._has_skipped and self._take_place(self._made):
            return  # a knob that is turned on and on is heard in steps, and not only when it stops
        self._has_skipped, self._made, self._tried = self._made is not None, None, wanted
        assert self._scene is not None
        self._building = self._builder.submit(self._make, scene_rebuilt(self._scene, wanted), self._scene)

    def _collect(self) -> None:
        if self._building is None or not self._building.done():
            return
        done, self._building = self._building, None
        try:
            self._made = done.result()
        except Unplayable as error:
            self._words = f"cannot be built: {error}"
            logging.error("no drum of %s: %s", self._named(self._tried), error)

    def _take_place(self, made: MadeDrum) -> bool:
        try:
            silent_in_s = self._enter(made)
        except MixerFull as error:
            self._words = f"waits, for {error}"
            self._next_at = time.monotonic() + _FULL_S
            return False
        if silent_in_s is None:
            self._words = "waits for the end of a contact"
            return False
        self._sounding, self._made, self._has_skipped = self._tried, None, False
        self._wait(silent_in_s)
        return True

    def _wait(self, silent_in_s: float) -> None:
        self._next_at = time.monotonic() + silent_in_s + _BESIDE_S if silent_in_s > 0.0 else 0.0
        self._words = "waits until the one before the present one is silent"

    def _named(self, values: Mapping[str, float]) -> str:
        return ", ".join(
            f"{name} {value:g}" for name, value in values.items() if value != self._sounding[name]
        )
