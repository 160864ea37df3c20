"""Request to set values of the rig, as it is asked for by a control."""

from dataclasses import dataclass, field

_WHOLE = "*"  # no parameter's name


@dataclass(frozen=True)
class SetRequest:
    """Values to be set as one, SI units, by wire name.

    `lease`: the requesting browser's secret, if it holds the writer's lease; `purpose`: what asked for a whole set.
    `before`: the values that held when it was requested.
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
        return _WHOLE if self.purpose else next(iter(self.values)), self.lease
