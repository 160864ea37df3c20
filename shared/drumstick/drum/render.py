"""Offline rendering: builds a drum, feeds it strikes or streamed contacts, yields its audio block by block."""

import dataclasses
import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.block import render_unlimited
from drumstick.drum.build import copy_of
from drumstick.drum.calibrate import build
from drumstick.drum.engine import OUTSIDE_FRAMES, Engine, hearing, set_live
from drumstick.drum.excitation.offline import ContactFeeder, StreamedContact
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.output.fade import CHOKE_S, CHOKED, REPLACED, Leaving, levels_after
from drumstick.drum.output.levels import settle_as_set
from drumstick.drum.output.limiter import limit
from drumstick.drum.pickups.places import be_at, fade_to, is_still, other_places
from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
from drumstick.drum.stems.separation import source_names
from drumstick.parameters.pickups import with_pickups_at
from drumstick.parameters.scene import Scene
from realtime.records import is_there

_BLOCK = 128
Sound = npt.NDArray[np.float32]
# Offline time begins at one second, because an onset of 0 ns would mean "at once".
_EPOCH_NS = 1_000_000_000


class LiveChange(NamedTuple):
    """A value of the drum that is set at t_s, s from the beginning, by its wire name."""

    t_s: float
    name: str
    value: float


class _Voices:
    # The drum that is struck, and those in whose place another one of the scene has come, while they ring on.
    def __init__(self, scene: Scene, rate_Hz: int, stems: bool) -> None:
        self._scene, self._rate_Hz = scene, rate_Hz
        self._fitted = fitted(scene, rate_Hz).scene
        self._wanted_listen = self._heard_listen = scene.listen
        self._apart = source_names(scene) if stems else ()
        self._sounding = self._wanted = rebuilt_values(scene)
        self._set: dict[str, float] = {}
        self.ring = StrikeRing()
        self._outside = np.zeros(OUTSIDE_FRAMES, np.float32)
        # It never sounds: a choke goes on with another copy.
        self._rest = build(self._fitted, rate_Hz, StrikeRing(), self._apart)
        self.engine = hearing(copy_of(self._rest, self.ring), self._outside)
        self._before: list[tuple[Engine, int, Leaving]] = []  # with the frames since another came

    def set(self, name: str, value: float) -> None:
        if name in self._wanted:
            self._wanted = {**self._wanted, name: value}
            return
        self._wanted_listen = with_pickups_at(self._wanted_listen, {name: value})
        self._set[name] = value
        for engine in (self.engine, *(engine for engine, *_ in self._before)):
            set_live(engine, name, value)

    def replace(self) -> bool:
        # Where what is set asks for another drum, let one take the place of the present one.
        if self._wanted == self._sounding:
            return False
        self._sounding = self._wanted
        scene = fitted(scene_rebuilt(self._scene, self._wanted), self._rate_Hz, measured_on=self._scene).scene
        self._rest = build(scene, self._rate_Hz, StrikeRing(), self._apart)
        self._fitted, self._heard_listen = scene, self._wanted_listen
        if is_there(self._rest.pickup_fade):
            be_at(self._rest, other_places(self._rest, self._elsewhere))
        self._go_on(REPLACED)
        return True

    def choke(self) -> None:
        # Those that ring on end with the one that is struck.
        self._before = [
            (engine, since, Leaving(min(leaving.rings_on_s, since / self._rate_Hz), CHOKE_S))
            if since < leaving.rings_on_s * self._rate_Hz
            else (engine, since, leaving)
            for engine, since, leaving in self._before
        ]
        self._go_on(CHOKED)

    def _go_on(self, leaving: Leaving) -> None:
        # With a copy of the one at rest, while the present one leaves.
        self._before.append((self.engine, 0, leaving))
        self.ring = StrikeRing()
        self.engine = hearing(copy_of(self._rest, self.ring), self._outside)
        for name, value in self._set.items():
            set_live(self.engine, name, value)
        settle_as_set(self.engine.listening)

    def render_beside(self, neighbours: Sound, out: Sound, at_ns: int) -> None:
        # While other drums sound, as the mixer has it: each block hears theirs of that time.
        for first in range(0, len(out), _BLOCK):
            heard = neighbours[first : first + _BLOCK].mean(axis=1, dtype=np.float64)
            self._outside[:] = 0.0
            self._outside[: len(heard)] = heard
            limit(self._outside[:, None])
            self.render(out[first : first + _BLOCK], at_ns + int(first * 1e9 / self._rate_Hz))

    @property
    def channels(self) -> int:
        return 2 + 2 * len(self._apart)

    @property
    def _elsewhere(self) -> Scene:
        # The scene of the drum that is struck, with its pickups where they are wanted.
        return dataclasses.replace(self._fitted, listen=self._wanted_listen)

    def _follow_pickups(self) -> None:
        if self._wanted_listen != self._heard_listen and is_still(self.engine):
            self._heard_listen = self._wanted_listen
            places = other_places(self.engine, self._elsewhere)
            fade_to(self.engine, places)
            be_at(self._rest, places)

    def render(self, out: Sound, at_ns: int) -> None:
        self._follow_pickups()
        if (
            len(out) > _BLOCK and self._wanted_listen != self._heard_listen
        ):  # a fade goes on, and another follows it
            self.render(out[:_BLOCK], at_ns)
            self.render(out[_BLOCK:], at_ns + int(_BLOCK * 1e9 / self._rate_Hz))
            return
        render_unlimited(self.engine, out, _BLOCK, at_ns)
        voice = np.empty_like(out)
        for engine, since, leaving in self._before:
            render_unlimited(engine, voice, _BLOCK, at_ns)
            out += voice * levels_after(len(out), since, self._rate_Hz, leaving)
        if not self._apart:
            limit(out)
        self._before = [
            (engine, since + len(out), leaving)
            for engine, since, leaving in self._before
            if since + len(out) < sum(leaving) * self._rate_Hz
        ]


def parts(
    scene: Scene,
    strikes: Iterable[OfflineStrike],
    duration_s: float,
    rate_Hz: int,
    contacts: Iterable[StreamedContact] = (),
    changes: Iterable[LiveChange] = (),
    chokes: Iterable[float] = (),
    neighbours: Sound | None = None,
    stems: bool = False,
) -> Iterator[Sound]:
    """The sound of `strikes` on the scene's drum as every sink would play it, a quarter of a second at a time.

    Shape (n, 2); the same array again and again. Equal strikes give equal samples, on one machine. `contacts` are for a
    scene that streams; then the parts are a hundredth of a second long. `changes` are of the drum's live values; a part
    ends where one begins. Another pitch or decay holds for the strikes that come from there on, while a sound server
    needs a moment to build that drum. `chokes` are instants, s: what was struck before ends there. neighbours: what
    other drums play meanwhile, shape (n, 2), for a scene with an effect that hears it. Raises Unplayable. Any thread.

    stems: shape (n, 2 + 2 S), not limited: what no pickup or microphone hears, then each by itself, in the order
    of `source_names`; `mixed` makes the mix of them.
    """
    voices = _Voices(scene, rate_Hz, stems)
    frames = round(duration_s * rate_Hz)
    played = list(contacts)
    feeder = ContactFeeder(voices.engine, played, _EPOCH_NS) if played else None
    part = np.zeros((max(rate_Hz // (4 if feeder is None else 100), 1), voices.channels), np.float32)
    waiting = deque(sorted(strikes, key=lambda blow: blow.t_s))
    coming = deque(sorted(changes, key=lambda change: change.t_s))
    choking = deque(sorted(chokes))
    done = 0
    while done < frames:
        while choking and round(choking[0] * rate_Hz) <= done:
            choking.popleft()
            voices.choke()
            if feeder is not None:
                feeder.move_on_to(voices.engine)
        while coming and round(coming[0].t_s * rate_Hz) <= done:
            change = coming.popleft()
            voices.set(change.name, change.value)
        # The force of one contact goes to one drum.
        if (feeder is None or not feeder.is_pressed) and voices.replace() and feeder is not None:
            feeder.move_to(voices.engine)
        next_choke_s = choking[0] if choking else math.inf
        next_s = min(coming[0].t_s if coming else math.inf, next_choke_s)
        end = min(round(next_s * rate_Hz), frames) if next_s < duration_s else frames
        out = part[: end - done]
        until_s = (done + len(out)) / rate_Hz
        while waiting and waiting[0].t_s < min(until_s, next_choke_s):
            blow = waiting[0]
            if not voices.ring.push_blow(blow, _EPOCH_NS + round(blow.t_s * 1e9)):
                break
            waiting.popleft()
        if feeder is not None:
            feeder.give(until_s, next_choke_s)
        at_ns = _EPOCH_NS + round(done * 1e9 / rate_Hz)
        if neighbours is None:
            voices.render(out, at_ns)
        else:
            voices.render_beside(neighbours[done : done + len(out)], out, at_ns)
        done += len(out)
        yield out


def mixed(stems: Sound) -> Sound:
    """The mix (n, 2) of all pairs of a part, limited as every sink does it."""
    mix = stems.reshape(len(stems), -1, 2).sum(axis=1, dtype=np.float64).astype(np.float32)
    limit(mix)
    return mix


def render(
    scene: Scene,
    strikes: Iterable[OfflineStrike],
    duration_s: float,
    rate_Hz: int,
    contacts: Iterable[StreamedContact] = (),
    changes: Iterable[LiveChange] = (),
    chokes: Iterable[float] = (),
    neighbours: Sound | None = None,
) -> Sound:
    """`parts` in one piece, shape (n, 2)."""
    whole = parts(scene, strikes, duration_s, rate_Hz, contacts, changes, chokes, neighbours)
    found = [part.copy() for part in whole]
    return np.concatenate(found) if found else np.zeros((0, 2), np.float32)
