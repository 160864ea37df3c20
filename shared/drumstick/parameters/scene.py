"""A scene: which physics is computed, with which numbers.

A table that its text does not name is absent (an effect) or has its defaults (`[stick]`, `[drum]` ...).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from drumstick.parameters.drum import Drum, Listen, Mesh, Modal
from drumstick.parameters.mallet import Mallet
from drumstick.parameters.rig import Device, Guard, Hand, Servo
from drumstick.parameters.stick import Stick
from drumstick.parameters.strike import Strike


@dataclass(frozen=True)
class Scene:
    """A validated scene. `effects` holds only what the text named: of each effect its table.

    Its tables are read by their keys in the TOML; `dataclasses.replace` makes a changed copy, unchecked.

    >>> import drumstick as ds
    >>> roll = ds.scene("roll")
    >>> roll.stick.k_coll_N_per_m, list(roll.effects), roll.servo.rate_Hz
    (5000.0, ['pulse'], 1000)
    """

    name: str
    words: str = ""
    stick: Stick = field(default_factory=Stick)
    effects: Mapping[str, Any] = field(default_factory=dict[str, Any])
    drum: Drum = field(default_factory=Drum)
    mesh: Mesh = field(default_factory=Mesh)
    modal: Modal | None = None  # instead of the mesh
    mallet: Mallet | None = None  # where it excites the drum
    listen: Listen = field(default_factory=Listen)
    strike: Strike = field(default_factory=Strike)
    hand: Hand = field(default_factory=Hand)
    device: Device = field(default_factory=Device)
    servo: Servo = field(default_factory=Servo)
    guard: Guard = field(default_factory=Guard)

    @property
    def hand_moves_stick(self) -> bool:
        """True when a recorded gesture moves the hand of the exact stick."""
        return self.hand.gesture == "recorded" and self.device.plant == "stick"


def require_scene(given: object) -> None:
    """Raise TypeError for what is no scene, as a name or a path, and say how it becomes one."""
    if not isinstance(given, Scene):
        how = (
            f": ds.scene({given!r}) reads one"
            if isinstance(given, str) or hasattr(given, "__fspath__")
            else ""
        )
        raise TypeError(f"{given!r} is no scene{how}")
