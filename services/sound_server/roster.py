"""Rigs whose drums are played: those named, and those that came by a pattern while there is a seat.

Each rig has a seat: a Zenoh session, a drum and a thread of its own, so that one that hangs, goes or comes back
touches no other. All methods belong to the main thread.
"""

import logging
import threading
from collections.abc import Callable, Sequence

from realtime.stop import StopRequest

_JOIN_S = 5.0

Play = Callable[[str, StopRequest], None]


class _Seat:
    # One rig's. `play` runs on a thread of its own until its stop is asked for.
    def __init__(self, rig: str, play: Play) -> None:
        self.stop = StopRequest()
        self._thread = threading.Thread(target=play, args=(rig, self.stop), name=f"drum {rig}", daemon=True)
        self._thread.start()

    @property
    def is_over(self) -> bool:
        return not self._thread.is_alive()

    def end(self) -> None:
        self._thread.join(_JOIN_S)


class Roster:
    """`named` rigs have a seat from the start, for ever; others as `follow` says. At most `most` seats.

    `play(rig, stop)` plays one rig's drum until `stop` is set, and has it fade before it returns.
    """

    def __init__(self, named: Sequence[str], most: int, play: Play) -> None:
        self._named, self._most, self._play = tuple(named), most, play
        self._seats = {rig: _Seat(rig, play) for rig in self._named}
        self._turned_away: set[str] = set()

    def follow(self, present: Sequence[str]) -> None:
        """Seat the rigs that are there, first come first served, and let go of those that are not."""
        for rig, seat in list(self._seats.items()):
            if rig in self._named:
                continue
            if seat.is_over and seat.stop.is_set():
                del self._seats[rig]
            elif rig not in present and not seat.stop.is_set():
                logging.info("rig %s is gone: its drum fades", rig)
                seat.stop.ask()
        for rig in present:
            if rig not in self._seats:
                self._seat(rig)
        self._turned_away.intersection_update(present)

    def _seat(self, rig: str) -> None:
        if len(self._seats) < self._most:
            self._turned_away.discard(rig)
            self._seats[rig] = _Seat(rig, self._play)
            logging.info("rig %s came: %d of at most %d drums", rig, len(self._seats), self._most)
        elif rig not in self._turned_away:
            self._turned_away.add(rig)
            logging.warning(
                "rig %s came and is not played: this server plays %d rigs already, its most (--most-rigs); another"
                " sound server can play it",
                rig,
                self._most,
            )

    @property
    def rigs(self) -> list[str]:
        """Rigs that have a seat."""
        return list(self._seats)

    @property
    def is_broken(self) -> bool:
        """True when a drum's thread ended without having been asked to."""
        return any(seat.is_over and not seat.stop.is_set() for seat in self._seats.values())

    def close(self) -> None:
        """End every seat; waits some seconds for each at most."""
        for seat in self._seats.values():
            seat.stop.ask()
        for seat in self._seats.values():
            seat.end()
