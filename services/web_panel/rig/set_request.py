"""Request to set values of the rig, as it is asked for by a control."""

from dataclasses import dataclass, field

_WHOLE = "*"  # no parameter's name
ROLL = "roll"  # purpose of a request for a rate or a level


@dataclass(frozen=True)
class SetRequest:
    """Values to be set as one, SI units, by wire name.

    `lease`: the requesting browser's secret, if it holds the writer's lease; `purpose`: what asked for a whole set.
    `before`: the values that held when it was requested. Of the purpose ROLL, `values` has the "rate", Hz, or "level"
    that is asked for; others come of it.
    """

    values: dict[str, float]
    lease: str = ""
    purpose: str = ""
    before: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def place(self) -> tuple[str, str]:
        """Key in the queue, where it replaces an older one: its parameter, or whole sets, and whose request it is.
        Else a refused browser's request would replace that of the one who holds the lease.
        """
        whole = self.purpose not in ("", ROLL)
        return _WHOLE if whole else next(iter(self.values)), self.lease
