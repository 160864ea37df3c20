"""Interface of the network fronts to the rig: read the parameters, set them, stop the forces."""

from collections.abc import Mapping
from typing import Protocol

from drumstick.parameters.table import Parameter
from haptic_server.gateway.lease import LeaseHolder
from protocol.messages import SetReply
from protocol.requests import ANYBODY, Claim


class ParameterAccess(Protocol):
    """One object serves every way in (OSC, Zenoh); any thread may call it."""

    @property
    def table(self) -> Mapping[str, Parameter]:
        """Wire name -> row, of what the scene contains. Fixed while the gateway lives."""
        ...

    def values(self) -> dict[str, float]:
        """The servo's readback, SI units; NaN where a parameter has no value (z_h0 of a hand without stiffness)."""
        ...

    def accepted_values(self) -> dict[str, float]:
        """Values that the servo will use once it has taken the newest accepted set."""
        ...

    def set(self, changes: Mapping[str, float], source: str, claim: Claim = ANYBODY) -> SetReply:
        """Set all of `changes` or, raising drumstick.parameters.table.Refusal, none. Blocks a few ms at most.

        No readback follows an answer that is not pending: what was set is so already.

        `source` names who asked, for the log, e.g. "osc 127.0.0.1:50412"; `claim`: what must hold for it.
        """
        ...

    def take_lease(self, who: str, name: str, seconds: float) -> LeaseHolder:
        """Take, renew or (0 s) give back the right to be the only one who sets; raises Refusal."""
        ...

    def panic(self, source: str) -> None:
        """Zero force at once, latched. Never refuses; may be called again."""
        ...
