"""What the haptic server says to a wish: taken, refused, or nothing at all."""

from dataclasses import dataclass

from protocol.messages import Readback, RefusalReply, SetReply, decode

NO_ANSWER = "no answer from the haptic server: nothing was changed as far as this page knows"


@dataclass(frozen=True)
class Answer:
    """`readback` when taken; else `reason` says in words why not."""

    readback: Readback | None = None
    reason: str = ""

    @property
    def taken(self) -> bool:
        """True when the haptic server said yes."""
        return not self.reason


def refused(payload: bytes) -> Answer:
    """From the payload of an error reply; one that is no RefusalReply is shown as text."""
    try:
        return Answer(reason=decode(payload, RefusalReply).reason or "refused without a reason")
    except ValueError:
        return Answer(reason=payload.decode("utf-8", "replace")[:300] or "refused without a reason")


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
        return Answer(reason="the haptic server's answer could not be read; the value below is what it uses")
