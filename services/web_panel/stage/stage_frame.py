"""Frames of the stage page, 30 a second: where the stick was since the last one, and what was struck. Pure.

Times are the servo's, in ms; lengths in radii of the head, speeds in radii a second.
"""

from functools import lru_cache
from typing import NamedTuple

import msgspec

from protocol.messages import STICK, Release, State, Strike
from web_panel.page.wording import Mood, notice_of
from web_panel.rig.rig_state import RigState
from web_panel.rig.stick_shape import Point, StickShape, grip_of, height_of, stick_shape
from web_panel.rig.view_subscriptions import RELEASES, STRIKES

NEEDS = frozenset({STRIKES, RELEASES})
_shape = lru_cache(maxsize=1)(stick_shape)


class Place(NamedTuple):
    """The tip at one instant, the speed upwards there, and the grip."""

    at_ms: float
    tip: Point
    v: float
    grip: Point


class Flash(NamedTuple):
    """A place on the head that was struck; level 0 .. 1."""

    at_ms: float
    x: float
    y: float
    level: float


class StageFrame(msgspec.Struct, frozen=True):
    """`words` are "" while the stick plays."""

    words: str
    mood: Mood
    stick: StickShape | None = None
    places: tuple[Place, ...] = ()
    flashes: tuple[Flash, ...] = ()


def stage_frame(rig_state: RigState, rig: str, now: float) -> StageFrame:
    """The frame of what is new in `rig_state`; a rig that was not heard has words only."""
    notice = notice_of(rig_state.connected, rig_state.state, rig_state.silent_s(now), rig)
    words = "" if rig_state.plays(now) else notice.headline
    if rig_state.state is None or rig_state.scene is None:
        return StageFrame(words, notice.mood)
    radius_m = rig_state.scene.drum.radius_m
    path = _Path(radius_m, rig_state.z_h0_m, rig_state.state)
    own = {strike.seq: strike for _, strike in rig_state.new_strikes if strike.source == STICK}
    # Between two states, a thirtieth of a second apart, a roll's stick may have been down and up again: its contacts
    # say when, and how fast it came and went.
    places = (
        *(path.of_state(state) for _, state in rig_state.new_states),
        *(path.of_strike(strike) for strike in own.values()),
        *(path.of_release(release) for _, release in rig_state.new_releases if release.source == STICK),
    )
    flashes = tuple(
        Flash(_ms(s.t_ns), s.x, s.y, min(max(s.level, 0.0), 1.0)) for _, s in rig_state.new_strikes
    )
    return StageFrame(
        words, notice.mood, _shape(radius_m), tuple(sorted(places, key=lambda p: p.at_ms)), flashes
    )


def _ms(t_ns: int) -> float:
    return round(t_ns * 1e-6, 2)


class _Path:
    def __init__(self, radius_m: float, z_h0_m: float, state: State) -> None:
        self._radius_m, self._z_h0_m, self._x, self._y = radius_m, z_h0_m, state.x, state.y

    def _place(self, t_ns: int, x: float, y: float, z_m: float, v_m_per_s: float) -> Place:
        tip = (x, y, height_of(z_m, self._radius_m))
        return Place(_ms(t_ns), tip, v_m_per_s / self._radius_m, grip_of(tip, self._z_h0_m, self._radius_m))

    def of_state(self, state: State) -> Place:
        return self._place(state.t_ns, state.x, state.y, state.z_m, state.v_m_per_s)

    def of_strike(self, strike: Strike) -> Place:
        return self._place(strike.t_ns, strike.x, strike.y, 0.0, -strike.z_speed_m_per_s)

    def of_release(self, release: Release) -> Place:
        return self._place(release.t_ns, self._x, self._y, 0.0, release.exit_speed_m_per_s)
