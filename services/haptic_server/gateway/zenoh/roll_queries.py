"""Queries of `play/rate`, `play/level` and `play/roll`, answered when the roll is found and set, or refused.

They have a thread of their own, which only hands them on: the thread of the rolls answers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from drumstick.analysis.ramp import Leg
from haptic_server.gateway.rolls.rolls import LEVEL, RATE, Outcome, Rolls, Standing
from protocol import messages
from protocol.keys import Keys
from protocol.query_thread import Questions, payload_of, refuse
from protocol.queryables import Queryables
from protocol.requests import requested_roll, requested_way

if TYPE_CHECKING:
    import zenoh


class RollQueries:
    """Queries of one rig, and what it tells of its roll; `rolls` is replaced with the scene."""

    def __init__(self, session: zenoh.Session, keys: Keys, rolls: Rolls, queryables: Queryables) -> None:
        self._session, self._keys, self.rolls = session, keys, rolls
        self._names = {keys.play_rate: RATE, keys.play_level: LEVEL}
        self._questions = Questions("rolls", self._answer)
        for key in (*self._names, keys.play_roll):
            queryables.declare_writing(key, self._questions.receive)

    def put(self, standing: Standing) -> None:
        """Publish what roll the values in use lead to; any thread."""
        for key, name in self._names.items():
            self._session.put(key, messages.encode(_of(standing, name)), encoding=messages.ENCODING)

    def close(self) -> None:
        """Stop answering."""
        self._questions.close()

    def _answer(self, query: zenoh.Query) -> bool:
        key, payload = str(query.key_expr), payload_of(query)
        if key == self._keys.play_roll:
            asked, claim = requested_roll(payload)
            legs = {
                name: Leg(value, asked.seconds)
                for name, value in ((RATE, asked.rate), (LEVEL, asked.level))
                if value is not None
            }
            self.rolls.request(legs, "zenoh", claim, partial(_reply, query, key, _as_set))
        elif payload:
            value, seconds, claim = requested_way(payload)
            of = partial(_as_readback, self._names[key])
            self.rolls.request(
                {self._names[key]: Leg(value, seconds)}, "zenoh", claim, partial(_reply, query, key, of)
            )
        else:
            self.rolls.tell(partial(self._reply_standing, query, key))
        return False

    def _reply_standing(self, query: zenoh.Query, key: str, standing: Standing) -> None:
        query.reply(key, messages.encode(_of(standing, self._names[key])), encoding=messages.ENCODING)
        query.drop()


def _of(standing: Standing, name: str) -> messages.Readback:
    value = standing.rate_Hz if name == RATE else standing.level
    return messages.Readback(value=value, revision=standing.revision, pending=standing.pending)


def _as_set(outcome: Outcome) -> messages.Message:
    assert outcome.reply is not None
    return outcome.reply


def _as_readback(name: str, outcome: Outcome) -> messages.Message:
    assert outcome.reply is not None
    value = outcome.rate_Hz if name == RATE else outcome.level
    return messages.Readback(value=value, revision=outcome.reply.revision, pending=outcome.reply.pending)


def _reply(query: zenoh.Query, key: str, of: Callable[[Outcome], messages.Message], outcome: Outcome) -> None:
    if outcome.late:
        return
    if outcome.refusal:
        refuse(query, outcome.refusal)
        return
    query.reply(key, messages.encode(of(outcome)), encoding=messages.ENCODING)
    query.drop()
