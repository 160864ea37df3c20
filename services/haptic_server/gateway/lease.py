"""The writer's lease: while somebody holds it, nobody else's sets are taken. Not needed to set, nor to panic.

The caller's lock guards it. Times are seconds of any clock that does not go back.
"""

from typing import NamedTuple

from drumstick.scenes.table import Refusal

MAX_S = 5.0
_MAX_NAME = 60


class LeaseHolder(NamedTuple):
    """Holder of the lease: `name` is shown to others, `left_s` is until it ends. Nobody: "" and 0."""

    name: str
    left_s: float


NOBODY = LeaseHolder("", 0.0)


class Lease:
    """Exclusive right to set, taken for a time."""

    def __init__(self) -> None:
        self._id = ""
        self._name = ""
        self._until_s = 0.0

    def holder(self, now_s: float) -> LeaseHolder:
        """Present holder."""
        return LeaseHolder(self._name, self._until_s - now_s) if now_s < self._until_s else NOBODY

    def take(self, who: str, name: str, seconds: float, now_s: float) -> LeaseHolder:
        """Take or renew it for at most 5 s; 0 s gives it back. `who` is the holder's secret. Raises Refusal."""
        if not (who and name.strip() and name.isprintable() and len(name) <= _MAX_NAME):
            raise Refusal(f"lease: name yourself in 1 to {_MAX_NAME} printable characters")
        if not 0.0 <= seconds <= MAX_S:
            raise Refusal(f"lease: {seconds:g} s is outside 0 .. {MAX_S:g} s; renew it while you work")
        self.require(who, now_s)
        self._id, self._name, self._until_s = who, name, now_s + seconds
        return self.holder(now_s)

    def require(self, who: str, now_s: float) -> None:
        """Raise Refusal when somebody else than `who` holds it."""
        if now_s < self._until_s and who != self._id:
            raise Refusal(
                f"{self._name} is tuning and holds the lock: ask them to unlock it (PANIC works all the same)"
            )
