"""Plays cues on time: absolute deadlines on the monotonic clock, each message at its own. The main thread."""

import time
from collections import Counter
from collections.abc import Callable, Sequence

import msgspec

from protocol.messages import State, Strike
from realtime.stop import StopRequest
from rig.recording import channels
from rig.replaying.cues import Cue, Renumbering, pass_ns
from rig.replaying.lateness import Lateness
from rig.replaying.osc_out import OscOut
from rig.replaying.replay_server import ReplayServer

_MAX_SLEEP_S = 0.02  # so that a stop is heard
_ALIVE_EVERY_NS = 1_000_000_000


class ReplayPlayer:
    """`panicked`: whether somebody asked for zero force; the playing ends there."""

    def __init__(
        self,
        cues: Sequence[Cue],
        renumbering: Renumbering,
        stand_in: ReplayServer,
        osc: OscOut,
        rig: str,
        panicked: Callable[[], bool],
    ) -> None:
        self._cues = list(cues)
        self._renumbering = renumbering
        self._stand_in = stand_in
        self._osc = osc
        self._rig = rig
        self._panicked = panicked
        self._state: State | None = None
        self._strikes = 0
        self._alive_at_ns = 0
        self.lateness = Lateness()
        self.count: Counter[str] = Counter()
        self.passes = 0
        self._stopped = False

    def play(self, stop: StopRequest, loop: bool, lead_s: float) -> str:
        """Play once, or until stopped, `lead_s` from now; how it ended: "done", "stopped" or "panic"."""
        begin_ns = time.monotonic_ns() + round(lead_s * 1e9)
        lasts_ns = pass_ns(self._cues)
        while True:
            for cue in self._cues:
                if not self._wait(begin_ns + cue.at_ns, stop):
                    return self._end()
                self._send(cue, begin_ns)
            self.passes += 1
            if not loop:
                return self._end()
            begin_ns += lasts_ns

    def _wait(self, due_ns: int, stop: StopRequest) -> bool:
        # Until it is due; False when the playing is to end.
        while not (stop.is_set() or self._panicked()):
            now_ns = time.monotonic_ns()
            if now_ns >= self._alive_at_ns:
                self._alive_at_ns = now_ns + _ALIVE_EVERY_NS
                self._osc.alive(self._rig, self._status(), self._strikes)
            left_ns = due_ns - time.monotonic_ns()
            if left_ns <= 0:
                return True
            time.sleep(min(left_ns * 1e-9, _MAX_SLEEP_S))
        self._stopped = True
        return False

    def _send(self, cue: Cue, begin_ns: int) -> None:
        message = self._renumbering.renumbered(cue, begin_ns, self.passes)
        self.lateness.note(time.monotonic_ns() - (begin_ns + cue.at_ns))
        self._stand_in.put(cue.channel, cue.name, message)
        self._osc.send(cue.name, message)
        self.count[cue.channel.topic] += 1
        if isinstance(message, State):
            self._state = message
        elif isinstance(message, Strike):
            self._strikes += 1

    def _status(self) -> str:
        return "playing" if self._state is None else self._state.status

    def _end(self) -> str:
        if not self._panicked():
            return "stopped" if self._stopped else "done"
        now_ns = time.monotonic_ns()
        if self._state is not None:
            last = msgspec.structs.replace(self._state, t_ns=now_ns, status="panic", force_N=0.0)
            self._stand_in.put(channels.STATE, "", last)
        self._osc.alive(self._rig, "panic", self._strikes)
        return "panic"
