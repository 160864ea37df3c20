"""Pickups of the drum that sounds, moved to where the rig's live values have them, one crossfade after the other."""

import dataclasses
import threading
from collections.abc import Mapping

from drumstick.drum.engine import Engine
from drumstick.drum.pickups.places import be_at, fade_to, is_still, other_places
from drumstick.parameters.drum import Listen
from drumstick.parameters.pickups import with_pickups_at
from drumstick.parameters.scene import Scene
from realtime.records import is_there


def moved(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene with its pickups at these live values, by wire name."""
    return dataclasses.replace(scene, listen=with_pickups_at(scene.listen, values))


class PickupMoves:
    """`entering` is held while another drum is let in, and here while the pickups of the present one are moved."""

    def __init__(self, entering: threading.Lock) -> None:
        self._entering = entering
        self._scene: Scene | None = None
        self._engines: tuple[Engine, ...] = ()
        self._heard = Listen()

    def play(self, scene: Scene, heard: Listen, engine: Engine, rest: Engine) -> None:
        """This engine of the (fitted) scene is struck from now on, whose pickups hear at `heard`; `rest` is the copy
        that never sounds. Under `entering`."""
        self._scene, self._heard, self._engines = scene, heard, (engine, rest)

    def choke(self, engine: Engine) -> None:
        """A copy of `rest` is struck from now on. Under `entering`."""
        self._engines = (engine, *self._engines[1:])

    def step(self, values: Mapping[str, float]) -> bool:
        """Go on to the places that these live values, by wire name, have; True when the pickups are there.

        The drum's thread. May take 0.1 s for a large bank.
        """
        with self._entering:
            scene, engines, heard = self._scene, self._engines, self._heard
        if scene is None or not is_there(engines[0].pickup_fade):
            return True
        there = moved(scene, values)
        if there.listen == heard or not is_still(engines[0]):
            return there.listen == heard and is_still(engines[0])
        places = other_places(engines[0], there)
        with self._entering:
            if self._engines is engines:  # else it was choked meanwhile: the next turn moves the other one
                fade_to(engines[0], places)
                be_at(engines[1], places)
                self._heard = there.listen
        return False
