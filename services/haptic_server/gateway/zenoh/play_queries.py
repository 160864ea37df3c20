"""Queries of `play/strike` and `play/choke`, answered with the strike or choke that was published.

They have a thread of their own: no set and no question stands before a strike, and no flood of strikes before a set.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from haptic_server.gateway.played_strikes import PlayedStrikes
from protocol import messages
from protocol.keys import Keys
from protocol.query_thread import Questions, payload_of
from protocol.queryables import Queryables
from protocol.requests import requested_choke, requested_strike

if TYPE_CHECKING:
    import zenoh


class PlayQueries:
    """Queries of one rig; `played` is replaced with the scene."""

    def __init__(self, keys: Keys, played: PlayedStrikes, queryables: Queryables) -> None:
        self._keys, self.played = keys, played
        self._questions = Questions("played strikes", self._answer)
        for key in (keys.play_strike, keys.play_choke):
            queryables.declare_writing(key, self._questions.receive)

    def close(self) -> None:
        """Stop answering."""
        self._questions.close()

    def _answer(self, query: zenoh.Query) -> bool:
        key, payload = str(query.key_expr), payload_of(query)
        if key == self._keys.play_choke:
            published = self.played.choke(_named(requested_choke(payload)))
        elif key == self._keys.play_strike:
            asked = requested_strike(payload)
            published = self.played.play(asked.x, asked.y, asked.level, _named(asked.name))
        else:
            raise ValueError(f"{key}: name one key")
        query.reply(key, messages.encode(published), encoding=messages.ENCODING)
        return True


def _named(player: str) -> str:
    return f"zenoh {player}".rstrip()
