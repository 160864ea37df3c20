"""Detection of lost messages: strikes, releases and forces missing from the sequence. The writing thread only."""

from collections import Counter

from protocol.messages import Choke, Contact, Message, Release, Strike
from rig.recording import channels
from rig.recording.channels import Channel

_CONTACTS = 64


class LostMessages:
    """Counts by topic what is missing between the first and the last that came, of each start of the servo."""

    def __init__(self) -> None:
        self.missing: Counter[str] = Counter()
        self._newest: dict[tuple[str, int], int] = {}
        self._next_tick: dict[tuple[int, int], int] = {}

    def note(self, channel: Channel, message: Message) -> None:
        """One message that came; again, or overtaken by a later one, it fills no gap twice."""
        if isinstance(message, Strike | Release | Choke):
            self._note_number(channel, message.boot, message.seq)
        elif isinstance(message, Contact):
            self._note_piece(message)

    def _note_number(self, channel: Channel, boot: int, seq: int) -> None:
        newest = self._newest.get((channel.topic, boot))
        if newest is None or seq > newest:
            if newest is not None:
                self.missing[channel.topic] += seq - newest - 1
            self._newest[channel.topic, boot] = seq

    def _note_piece(self, piece: Contact) -> None:
        # Pieces of one contact follow each other tick by tick; the first that comes of one may be any.
        contact = (piece.boot, piece.seq)
        due = self._next_tick.get(contact)
        if due is not None and piece.first_tick > due:
            self.missing[channels.CONTACT.topic] += 1
        self._next_tick[contact] = piece.first_tick + len(piece.forces) // 4
        if len(self._next_tick) > _CONTACTS:
            del self._next_tick[next(iter(self._next_tick))]
