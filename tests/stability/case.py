"""Hard case: a row of the catalogue."""

from dataclasses import dataclass
from typing import Literal

Subject = Literal["stick", "servo", "mesh", "effects", "wire"]


@dataclass(frozen=True)
class Case:
    """One hard case, each part one sentence or two.

    hard: why it is hard. naive: what the method does that one would write first. ours: what this program does. bound:
    where the numbers come from against which the tests hold both.
    """

    name: str
    of: Subject
    hard: str
    naive: str
    ours: str
    bound: str
