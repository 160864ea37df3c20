"""Answer of the haptic server to a request: taken, refused, or none at all."""

from dataclasses import dataclass, field

from protocol.messages import PresetReply, Readback, RefusalReply, SetReply, decode

NO_ANSWER = "no answer from the haptic server; the value shown is what it last said"


@dataclass(frozen=True)
class Answer:
    """`readbacks` when values were taken; else `reason` says why not, and `refused` whether somebody said no or nobody
    answered. A readback that is pending is not what the servo uses, but what it will."""

    readbacks: dict[str, Readback] = field(default_factory=dict[str, Readback])
    reason: str = ""
    refused: bool = False
    note: str = ""  # what else to know of what was taken

    @property
    def taken(self) -> bool:
        """True when the haptic server said yes."""
        return not self.reason

    @property
    def words(self) -> str:
        """Text beside the control; empty when taken and nothing more need be known."""
        return self.words_about("")

    def words_about(self, value: str) -> str:
        """Like `words`, naming the value, with its unit, that was asked for."""
        if self.taken:
            return self.note
        verdict = "Refused" if self.refused else "Not confirmed"
        return f"{verdict}{f', {value}' if value else ''}: {self.reason}"


def refused(payload: bytes) -> Answer:
    """Answer from the payload of an error reply; one that is no RefusalReply is shown as text."""
    try:
        reason = decode(payload, RefusalReply).reason
    except ValueError:
        reason = payload.decode("utf-8", "replace")[:300]
    return Answer(reason=reason or "no reason given", refused=True)


def loaded(payload: bytes) -> Answer:
    """Answer from the payload of a reply to `preset/load`: the values it brought, and the note for the technician."""
    try:
        reply = decode(payload, PresetReply)
    except ValueError:
        return _UNREADABLE
    return Answer(_readbacks(reply), note=reply.note)


def accepted(name: str, payload: bytes) -> Answer:
    """Answer from the payload of a reply to `set/<name>`: a Readback."""
    try:
        return Answer({name: decode(payload, Readback)})
    except ValueError:
        return all_accepted(payload)  # a reply to a set of several carries the same facts


def all_accepted(payload: bytes) -> Answer:
    """Answer from the payload of a reply to `set`."""
    try:
        return Answer(_readbacks(decode(payload, SetReply)))
    except ValueError:
        return _UNREADABLE


def _readbacks(reply: SetReply | PresetReply) -> dict[str, Readback]:
    return {
        name: Readback(value=value, revision=reply.revision, pending=reply.pending)
        for name, value in reply.values.items()
    }


_UNREADABLE = Answer(reason="the haptic server's answer could not be read; the values shown are what it uses")
