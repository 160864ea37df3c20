"""What the haptic server says to a wish: taken, refused, or nothing at all."""

from dataclasses import dataclass

from protocol.messages import PresetReply, Readback, RefusalReply, SetReply, decode

NO_ANSWER = "no answer from the haptic server; the value shown is what it last said"


@dataclass(frozen=True)
class Answer:
    """`readback` when taken; else `reason` says why not, and `refused` whether somebody said no or nobody answered."""

    readback: Readback | None = None
    reason: str = ""
    refused: bool = False
    note: str = ""  # what else to know of what was taken

    @property
    def taken(self) -> bool:
        """True when the haptic server said yes."""
        return not self.reason

    @property
    def words(self) -> str:
        """What to show beside the control; empty when taken and nothing more need be known."""
        if self.taken:
            return self.note
        return f"{'Refused' if self.refused else 'Not confirmed'}: {self.reason}"


def refused(payload: bytes) -> Answer:
    """From the payload of an error reply; one that is no RefusalReply is shown as text."""
    try:
        reason = decode(payload, RefusalReply).reason
    except ValueError:
        reason = payload.decode("utf-8", "replace")[:300]
    return Answer(reason=reason or "no reason given", refused=True)


def loaded(payload: bytes) -> Answer:
    """From the payload of a reply to `preset/load`: readbacks come by themselves, the note is for the technician."""
    try:
        note = decode(payload, PresetReply).note
    except ValueError:
        return Answer(
            reason="the haptic server's answer could not be read; the values shown are what it uses"
        )
    return Answer(note=note)


def accepted(name: str, payload: bytes) -> Answer:
    """From the payload of a reply to `set/<name>`: a Readback."""
    try:
        return Answer(readback=decode(payload, Readback))
    except ValueError:
        pass  # perhaps the reply to a set of several, which carries the same facts
    try:
        reply = decode(payload, SetReply)
        return Answer(
            readback=Readback(value=reply.values[name], revision=reply.revision, pending=reply.pending)
        )
    except (ValueError, KeyError):
        return Answer(reason="the haptic server's answer could not be read; the value shown is what it uses")
