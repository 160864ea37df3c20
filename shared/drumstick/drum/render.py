"""Offline rendering: builds a drum, feeds it strikes or streamed contacts, yields its audio block by block."""

from collections import deque
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_all
from drumstick.drum.calibrate import build
from drumstick.drum.engine import set_live
from drumstick.drum.excitation.offline import ContactFeeder, StreamedContact
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.parameters.scene import Scene

_BLOCK = 128
# Offline time begins at one second, because an onset of 0 ns would mean "at once".
_EPOCH_NS = 1_000_000_000


class LiveChange(NamedTuple):
    """A value of the drum that is set at t_s, s from the beginning, by its wire name."""

    t_s: float
    name: str
    value: float


def parts(
    scene: Scene,
    strikes: Iterable[OfflineStrike],
    duration_s: float,
    rate_Hz: int,
    contacts: Iterable[StreamedContact] = (),
    changes: Iterable[LiveChange] = (),
) -> Iterator[npt.NDArray[np.float32]]:
    """The sound of `strikes` on the scene's drum as every sink would play it, a quarter of a second at a time.

    Shape (n, 2); the same array again and again. Equal strikes give equal samples, on one machine. `contacts` are for a
    scene that streams; then the parts are a hundredth of a second long. `changes` are of the drum's live values; a part
    ends where one begins. Any thread.
    """
    ring = StrikeRing()
    engine = build(scene, rate_Hz, ring)
    frames = round(duration_s * rate_Hz)
    played = list(contacts)
    feeder = ContactFeeder(engine, played, _EPOCH_NS) if played else None
    part = np.zeros((max(rate_Hz // (4 if feeder is None else 100), 1), 2), np.float32)
    waiting = deque(sorted(strikes, key=lambda blow: blow.t_s))
    coming = deque(sorted(changes, key=lambda change: change.t_s))
    done = 0
    while done < frames:
        while coming and round(coming[0].t_s * rate_Hz) <= done:
            change = coming.popleft()
            set_live(engine, change.name, change.value)
        end = min(round(coming[0].t_s * rate_Hz), frames) if coming else frames
        out = part[: end - done]
        until_s = (done + len(out)) / rate_Hz
        while waiting and waiting[0].t_s < until_s:
            blow = waiting[0]
            if not ring.push_blow(blow, _EPOCH_NS + round(blow.t_s * 1e9)):
                break
            waiting.popleft()
        if feeder is not None:
            feeder.give(until_s)
        render_all(engine, out, _BLOCK, _EPOCH_NS + round(done * 1e9 / rate_Hz))
        done += len(out)
        yield out


def render(
    scene: Scene,
    strikes: Iterable[OfflineStrike],
    duration_s: float,
    rate_Hz: int,
    contacts: Iterable[StreamedContact] = (),
    changes: Iterable[LiveChange] = (),
) -> npt.NDArray[np.float32]:
    """`parts` in one piece, shape (n, 2)."""
    found = [part.copy() for part in parts(scene, strikes, duration_s, rate_Hz, contacts, changes)]
    return np.concatenate(found) if found else np.zeros((0, 2), np.float32)
