"""One line of `drumstick doctor`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing looked at. `needed`: without it `drumstick up` does not play; otherwise it plays less well."""

    name: str
    good: bool
    needed: bool
    found: str
    remedy: str = ""
