"""Rate and level of the roll: requests become sets of k_hand, z_ss and dv_pls; a ramp becomes one every 20 ms.

One thread of its own asks the process that finds rolls, sets, and tells what roll the values in use lead to. Requests
are queued by any thread: the newest of a kind wins. A request for one of the two leaves the other on its way, and waits
until a ramp has gone on for two strokes: one that were replaced sooner would have changed nothing yet.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from msgspec import structs

from drumstick.analysis.ramp import STEP_S, Leg, Ramp
from drumstick.analysis.unpulsed import why_no_roll
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Z_H0, Refusal
from drumstick.stick.law import DRUM
from drumstick.stick.strike_curve import level_at
from haptic_server.gateway.rolls.messages import Answer, FindRamp, Predict, Predicted, Question, Refused
from haptic_server.gateway.settings import Parameters
from protocol.messages import SetReply
from protocol.requests import Claim
from realtime.worker_process import NoAnswer, WorkerProcess

RATE, LEVEL = "rate", "level"
_PREDICT_EVERY_S = 0.1
_LONGEST_WAIT_S = 3600.0
_MOST_WAITING = 256
_OVER = "this scene is over: ask again"
_MEANWHILE = "the stick's values were changed meanwhile"
_log = logging.getLogger("gateway")


class Standing(NamedTuple):
    """Roll that the values in use lead to; 0, 0: none. On the way of a ramp: what it has come to."""

    rate_Hz: float
    level: float
    revision: int
    pending: bool


class Outcome(NamedTuple):
    """End of a request: the reply to its set and the roll that it leads to, or a refusal.

    late: a ramp was answered already, and ends on its way. superseded: refused for a newer request, as a fader's are.
    """

    reply: SetReply | None = None
    rate_Hz: float = 0.0
    level: float = 0.0
    refusal: str = ""
    late: bool = False
    superseded: bool = False


class _Request(NamedTuple):
    legs: Mapping[str, Leg]
    source: str
    claim: Claim
    answer: Callable[[Outcome], None]


class _Running(NamedTuple):
    ramp: Ramp
    began_s: float
    request: _Request


class Rolls:
    """Roll of one scene. `publish` gets every new standing."""

    def __init__(
        self,
        parameters: Parameters,
        finder: WorkerProcess[Answer],
        scene: Scene,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._parameters, self._finder, self._now = parameters, finder, now
        self._strike, self._why_not = scene.strike, why_no_roll(scene)
        self.publish: Callable[[Standing], None] = lambda _standing: None
        self._changed = threading.Condition()
        self._requests: dict[frozenset[str], _Request] = {}
        self._waiting: list[Callable[[Standing], None]] = []
        self._stale = self._closing = False
        self._standing: Standing | None = None
        self._running: _Running | None = None
        self._set: dict[str, float] = {}
        self._predict_at_s = self._step_at_s = -math.inf
        self._thread = threading.Thread(target=self._run, name="rolls", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    @property
    def standing(self) -> Standing | None:
        """Standing that was told last; None before anything was."""
        return self._standing

    def request(
        self, legs: Mapping[str, Leg], source: str, claim: Claim, answer: Callable[[Outcome], None]
    ) -> None:
        """Ask for a rate, a level or both; `answer` is called by another thread. Raises Refusal, worded.

        Any thread, whose call answers the request that this one supersedes; never waits.
        """
        self._require_roll()
        for name, leg in legs.items():
            if leg.to is None or not (math.isfinite(leg.to) and math.isfinite(leg.seconds)):
                raise Refusal(f"{name}: send finite numbers")
        self._parameters.require_free(claim)
        with self._changed:
            if self._closing:
                raise Refusal(_OVER)
            before = self._requests.pop(frozenset(legs), None)
            self._requests[frozenset(legs)] = _Request(legs, source, claim, answer)
            self._changed.notify()
        if before is not None:
            before.answer(Outcome(refusal="a newer request came before this one's turn", superseded=True))

    def tell(self, answer: Callable[[Standing], None]) -> None:
        """Tell what holds, by another thread. Raises Refusal, worded. Any thread; never waits."""
        self._require_roll()
        with self._changed:
            if self._closing:
                raise Refusal(_OVER)
            if len(self._waiting) >= _MOST_WAITING:
                raise Refusal("too many ask at once: ask again")
            self._waiting.append(answer)
            self._stale = self._stale or self._standing is None
            self._changed.notify()

    def note_change(self) -> None:
        """Take notice that the servo uses other values. Any thread; never waits."""
        if not self._why_not:
            with self._changed:
                self._stale = True
                self._changed.notify()

    def close(self) -> None:
        """End, once it has begun, and answer all who still wait. Waits for the thread. Idempotent."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._finder.close()
        self._thread.join()
        with self._changed:  # nobody comes after these
            requests, waiting = list(self._requests.values()), self._waiting
            self._requests, self._waiting = {}, []
        for request in requests:
            request.answer(Outcome(refusal=_OVER))
        if self._running is not None:
            self._end(self._running, "this scene is over")
        standing = self._standing or Standing(0.0, 0.0, self._parameters.live_revision, False)
        for answer in waiting:
            answer(standing)

    def _require_roll(self) -> None:
        if self._why_not:
            raise Refusal(self._why_not)

    def _run(self) -> None:
        while not self._closing:
            with self._changed:
                self._changed.wait(self._until_due_s())
            try:
                self.step()
            except Exception:  # noqa: BLE001  one fault of ours must not silence all that come after it
                _log.exception("rolls: a fault")
                self._running = None

    def _until_due_s(self) -> float:
        due_s = self._now() + _LONGEST_WAIT_S
        if self._closing or (self._waiting and self._standing is not None):
            return 0.0
        if self._running is not None:
            due_s = self._step_at_s
        if self._requests:
            due_s = min(due_s, self._request_at_s())
        if self._stale:
            due_s = min(due_s, self._predict_at_s)
        return max(0.0, due_s - self._now())

    def _request_at_s(self) -> float:
        running = self._running
        return -math.inf if running is None else running.began_s + 2.0 * running.ramp.lead_s

    def step(self) -> None:
        """Do what is due. The thread of its own, and tests without one."""
        if self._running is not None and self._of_stick() != self._set:
            self._end(self._running, _MEANWHILE)
        with self._changed:
            due = bool(self._requests) and self._now() >= self._request_at_s()
            request = self._requests.pop(next(iter(self._requests))) if due else None
        if request is not None:
            request.answer(self._begin(request))
        if self._running is not None and self._now() >= self._step_at_s:
            self._continue(self._running)
        if self._stale and self._now() >= self._predict_at_s:
            self._predict()
        if self._standing is not None:
            with self._changed:
                waiting, self._waiting = self._waiting, []
            for answer in waiting:
                answer(self._standing)

    def _begin(self, request: _Request) -> Outcome:
        # Set out towards what was asked for; the other of the two stays on its way.
        rate, level, under_way = Leg(), Leg(), None
        if self._running is not None:
            ramp, gone_s = self._running.ramp, self._now() - self._running.began_s
            rate, level = ramp.rate_leg.after(gone_s), ramp.level_leg.after(gone_s)
            under_way = ramp.stands_at(gone_s + ramp.lead_s)  # once the next one's lead is over
        rate, level = request.legs.get(RATE, rate), request.legs.get(LEVEL, level)
        held = self._of_stick()
        ramp = self._ask(FindRamp(self._values(), rate, level, under_way))
        if not isinstance(ramp, Ramp):
            return Outcome(refusal=ramp.why if isinstance(ramp, Refused) else "no answer")
        if self._of_stick() != held:
            return Outcome(refusal=f"{_MEANWHILE}: ask again")
        try:
            reply = self._take(ramp.at(0.0), request, request.claim)
        except Refusal as refusal:
            return Outcome(refusal=str(refusal))
        self._running, self._step_at_s = None, self._now() + STEP_S
        if ramp.seconds > 0.0:  # what was asked for is yet to come
            self._running = _Running(ramp, self._now(), request)
            reply = structs.replace(reply, values=ramp.values, pending=True)
        return Outcome(reply, ramp.end.rate_Hz, ramp.level)

    def _continue(self, running: _Running) -> None:
        since_s = self._now() - running.began_s
        self._step_at_s = self._now() + STEP_S
        claim = Claim(lease=running.request.claim.lease)
        try:
            self._parameters.require_quiet(claim)  # nothing may grow louder while a panic holds the stick
            self._take(running.ramp.at(since_s), running.request, claim)
        except Refusal as refusal:
            self._end(running, str(refusal))
            return
        if since_s >= running.ramp.seconds:
            self._running = None
            self.note_change()

    def _end(self, running: _Running, why: str) -> None:
        self._running = None
        _log.warning("ramp of %s: %s", running.request.source, why)
        running.request.answer(Outcome(refusal=f"{why}: the ramp ends here", late=True))

    def _take(self, values: Mapping[str, float], request: _Request, claim: Claim) -> SetReply:
        before = self._of_stick()
        reply = self._parameters.set(values, f"roll by {request.source}", claim)
        self._set = before | reply.values
        return reply

    def _values(self) -> dict[str, float]:
        # z_h0 is a view of z_ss, and may not be set beside it.
        return {name: v for name, v in self._parameters.accepted_values().items() if name != Z_H0}

    def _of_stick(self) -> dict[str, float]:
        table = self._parameters.table
        return {name: value for name, value in self._values().items() if table[name].effect != DRUM}

    def _predict(self) -> None:
        self._stale, self._predict_at_s = False, self._now() + _PREDICT_EVERY_S
        revision, pending = self._parameters.live_revision, self._parameters.pending
        if self._running is not None:  # its steps must not wait for another process
            rate_Hz, speed = self._running.ramp.stands_at(self._now() - self._running.began_s)
            told = Predicted(rate_Hz, level_at(self._strike, speed))
        else:
            values = {name: v for name, v in self._parameters.values().items() if name != Z_H0}
            answer = self._ask(Predict(values))
            if isinstance(answer, Refused):
                _log.warning("rolls: %s", answer.why)
            told = (
                answer if isinstance(answer, Predicted) else Predicted()
            )  # whoever asked waits for an answer
        self._standing = Standing(told.rate_Hz, told.level, revision, pending)
        self.publish(self._standing)

    def _ask(self, question: Question) -> Answer:
        try:
            return self._finder.ask(question)
        except NoAnswer as reason:
            return Refused(str(reason))
