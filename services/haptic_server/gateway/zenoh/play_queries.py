"""Queries of `play/strike`, answered with the strike that was published.

They have a thread of their own: no set and no question stands before a strike, and no flood of strikes before a set.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from haptic_server.gateway.played_strikes import PlayedStrikes
from protocol import messages
from protocol.keys import Keys
from protocol.query_thread import Questions, payload_of
from protocol.queryables import Queryables
from protocol.requests import requested_strike

if TYPE_CHECKING:
    import zenoh


class PlayQueries:
    """Queries of one rig; `played` is replaced with the scene."""

    def __init__(self, keys: Keys, played: PlayedStrikes, queryables: Queryables) -> None:
        self._key, self.played = keys.play_strike, played
        self._questions = Questions("played strikes", self._answer)
        queryables.declare_writing(self._key, self._questions.receive)

    def close(self) -> None:
        """Stop answering."""
        self._questions.close()

    def _answer(self, query: zenoh.Query) -> bool:
        asked = requested_strike(payload_of(query))
        strike = self.played.play(asked.x, asked.y, asked.level, f"zenoh {asked.name}".rstrip())
        query.reply(self._key, messages.encode(strike), encoding=messages.ENCODING)
        return True
