"""A muffle that is set while the drum plays: the real sound server asks for it, follows it, and comes back to it."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest
import zenoh
from haptic_side import HapticSide, drum, sounding

from drumstick.drum.effects.muffle import MuffleTable
from protocol.messages import Readback, encode

# The whole head lies under it, and loses 60 dB in two milliseconds where it is pressed.
OVER_ALL = MuffleTable(((0.0, 0.0, 1.0),), 0.002, press=0.0)


class Muffled(HapticSide):
    """It answers what the servo uses, whatever the scene says, and tells what is set."""

    press, revision = 1.0, 1

    def open(self, router: zenoh.Session | None = None) -> None:
        super().open(router)
        self.session.declare_queryable(self.keys.param("muffle"), self._answer_muffle)

    def _answer_muffle(self, query: zenoh.Query) -> None:
        query.reply(self.keys.param("muffle"), self._readback())

    def _readback(self) -> bytes:
        return encode(Readback(value=self.press, revision=self.revision))

    def set(self, press: float) -> None:
        self.press, self.revision = press, self.revision + 1
        self.session.put(self.keys.param("muffle"), self._readback())


@pytest.mark.long
def test_the_sound_server_follows_a_muffle_that_is_set(free_port: Callable[[], int], tmp_path: Path) -> None:
    scene = drum(t60_s=1.0)
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects={"muffle": OVER_ALL}))
    side = Muffled(free_port(), scene)
    try:
        with sounding(side.endpoint, "null", tmp_path):
            side.struck("three strokes", lambda m: m.played >= 3)
            muffled = max(meter.peak_left for meter in side.meters)
            assert muffled > 0.0
            side.set(0.0)
            side.struck("a drum that rings", lambda m: m.peak_left > 5.0 * muffled)
            side.set(1.0)
            side.struck("a drum that does not", lambda m: m.played > 6 and 0.0 < m.peak_left <= muffled)
            # A readback that was lost: the state's revision says that there is something to ask for.
            side.press, side.revision = 0.0, side.revision + 1
            side.tell_state(side.revision)
            side.struck("a drum that rings, though nobody said so", lambda m: m.peak_left > 5.0 * muffled)
            side.set(1.0)
            side.struck("a drum that does not", lambda m: m.played > 9 and 0.0 < m.peak_left <= muffled)
            # A servo that started anew counts its revisions anew: what holds then is asked for.
            side.boot, side.seq, side.press, side.revision = 8, 0, 0.0, 0
            side.tell_state()
            side.struck("a drum that rings again", lambda m: m.peak_left > 5.0 * muffled)
    finally:
        side.close()
