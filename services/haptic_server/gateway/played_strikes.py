"""Played strikes: those that no stick makes, but OSC, Zenoh, MIDI or the page. They move no arm. And chokes.

Each is told as the stick's are: with the speed that the scene's curve gives for its level, and the contact of an
isolated blow at that speed under the law that the servo uses. Their `boot` is none that a servo can have.
"""

import math
import secrets
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import Protocol

from drumstick.parameters.strike import Strike as StrikeTable
from drumstick.scenes.table import Refusal
from drumstick.stick.contact_ahead import isolated
from haptic_server.gateway.play_rate_limit import OF_ONE, PlayRateLimit
from haptic_server.gateway.settings import Parameters
from protocol.messages import Choke, Release, Strike

MIDI = "midi"  # source of a note's strike
_BOOT_BITS = 48  # of a servo's boot
_NOBODY = "no rig plays strikes here"
_STARTING = "the rig is starting: play again in a moment"
_RIM = 1.0 + 1e-6  # a place on the rim, rounded to 32 bits


class Player(Protocol):
    """Player of strikes and chokes, as PlayedStrikes is; both may raise Refusal."""

    def play(self, x: float, y: float, level: float, source: str) -> object:
        """Play a strike."""
        ...

    def choke(self, source: str) -> object:
        """Stop the drum."""
        ...


class NobodyPlays:
    """Refuses strikes and chokes, where no rig is behind the server."""

    def play(self, x: float, y: float, level: float, source: str) -> None:
        """Refuse a strike."""
        raise Refusal(_NOBODY)

    def choke(self, source: str) -> None:
        """Refuse a choke."""
        raise Refusal(_NOBODY)


NOBODY_PLAYS = NobodyPlays()


class PlayedStrikes:
    """Strikes played on one rig. `play` and `choke` belong to any thread, `step` and `release_all` to the gateway's
    main one."""

    def __init__(
        self, table: StrikeTable, parameters: Parameters, now_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self.boot = 1 << _BOOT_BITS | secrets.randbits(_BOOT_BITS)
        self._table, self._parameters, self._now_ns = table, parameters, now_ns
        self._lock = threading.Lock()
        self._rate_limit = PlayRateLimit()
        self._counts: Counter[str] = Counter()
        self._due: deque[Release] = deque()
        self._put_strike: Callable[[Strike], None] | None = None
        self._put_release: Callable[[Release], None] | None = None
        self._put_choke: Callable[[Choke], None] | None = None
        self._wake: Callable[[], None] = lambda: None

    def begin(
        self,
        put_strike: Callable[[Strike], None],
        put_release: Callable[[Release], None],
        put_choke: Callable[[Choke], None],
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        """Publish by these from now on: strikes and chokes on any thread, releases on the main one.

        `wake` is called, on any thread, when there is a release to come.
        """
        self._put_strike, self._put_release, self._put_choke = put_strike, put_release, put_choke
        self._wake = wake

    @property
    def counters(self) -> dict[str, int]:
        """Counts of strikes by the first word of their source, and of what was refused; a copy."""
        with self._lock:
            return dict(self._counts)

    def play(self, x: float, y: float, level: float, source: str) -> Strike:
        """Play a strike of this level at x, y, in radii; returns what was published. Raises Refusal, worded."""
        try:
            _check(x, y, level)
            strike, release = self._new_contact(x, y, level, source)
        except Refusal:
            with self._lock:
                self._counts["refused"] += 1
            raise
        assert self._put_strike is not None
        self._put_strike(strike)
        self._due.append(release)
        self._wake()
        return strike

    def choke(self, source: str) -> Choke:
        """Stop the drum; returns what was published. Limited together with strikes. Raises Refusal, worded."""
        if self._put_choke is None:
            raise Refusal(_STARTING)
        with self._lock:
            t_ns = self._now_ns()
            self._spend(source, t_ns)
            self._counts["chokes"] += 1
            choke = Choke(boot=self.boot, seq=self._counts["chokes"], t_ns=t_ns, source=source)
        self._put_choke(choke)
        return choke

    def _spend(self, source: str, now_ns: int) -> None:
        # With the lock held.
        if not self._rate_limit.spend(source, now_ns * 1e-9):
            self._counts["held_back"] += 1
            raise Refusal(f"more than {OF_ONE.per_s:g} strikes a second, or too many at once: not played")

    def _new_contact(self, x: float, y: float, level: float, source: str) -> tuple[Strike, Release]:
        if self._put_strike is None:
            raise Refusal(_STARTING)
        law = self._parameters.live_law
        speed = self._table.speed_at(level)
        blow = isolated(law[0], speed)
        peak_N = min(blow.peak_N, self._parameters.max_force_N)
        with self._lock:
            t_ns = self._now_ns()
            self._spend(source, t_ns)
            way = source.partition(" ")[0]
            self._counts[way] += 1
            self._counts["strikes"] += 1
            seq = self._counts["strikes"]
        strike = Strike(
            boot=self.boot, seq=seq, t_ns=t_ns, x=x, y=y, z_speed_m_per_s=speed, level=level,
            peak_estimate_N=peak_N, contact_estimate_s=blow.contact_s, impulse_N_s=blow.impulse_N_s, source=source,
        )  # fmt: skip
        release = Release(
            boot=self.boot, seq=seq, t_ns=t_ns + round(blow.contact_s * 1e9),
            exit_speed_m_per_s=blow.impulse_N_s / float(law[0]["m"]) - speed,
            impulse_N_s=blow.impulse_N_s, peak_N=peak_N, contact_s=blow.contact_s, source=source,
        )  # fmt: skip
        return strike, release

    def due_ns(self, otherwise: int) -> int:
        """Time at which the next release is due, monotonic ns; without one: `otherwise`."""
        return self._due[0].t_ns if self._due else otherwise

    def step(self, now_ns: int) -> None:
        """Publish the releases that are due."""
        while self._due and self._due[0].t_ns <= now_ns and self._put_release is not None:
            self._put_release(self._due.popleft())

    def release_all(self) -> None:
        """Publish every release that is not due yet: nobody steps any more. The gateway's main thread."""
        while self._due and self._put_release is not None:
            self._put_release(self._due.popleft())


def _check(x: float, y: float, level: float) -> None:
    for name, value in (("x", x), ("y", y), ("level", level)):
        if not math.isfinite(value):
            raise Refusal(f"{name} is {value}: send a finite number")
    if not math.hypot(x, y) <= _RIM:
        raise Refusal(f"x {x:g}, y {y:g} is beside the head: its radius is 1")
    if not 0.0 < level <= 1.0:
        raise Refusal(f"level {level:g} is outside 0 .. 1; 0 strikes nothing")
