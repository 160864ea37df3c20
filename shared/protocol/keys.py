"""Zenoh keys: drumstick/<rig>/..."""

import re
from dataclasses import dataclass

DEFAULT_RIG = "main"
DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
_RIG_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,39}")


def checked_rig(name: str) -> str:
    """The rig's name, when it can stand in a key; else ValueError."""
    if not _RIG_NAME.fullmatch(name):
        raise ValueError(f"rig name {name!r}: use 1 to 40 letters, digits, _ . or -, not a dot first")
    return name


@dataclass(frozen=True)
class Keys:
    """Every key of one rig."""

    rig: str

    def __post_init__(self) -> None:
        checked_rig(self.rig)

    def _key(self, name: str) -> str:
        return f"drumstick/{self.rig}/{name}"

    @property
    def strike(self) -> str:
        """Put: Strike."""
        return self._key("strike")

    @property
    def release(self) -> str:
        """Put: Release."""
        return self._key("release")

    @property
    def contact(self) -> str:
        """Put while the scene streams and somebody subscribes: Contact."""
        return self._key("contact")

    @property
    def state(self) -> str:
        """Put at 30 Hz: State."""
        return self._key("state")

    @property
    def meter(self) -> str:
        """Put at 10 Hz by a sound server: Meter."""
        return self._key("meter")

    @property
    def pointer(self) -> str:
        """Put, best effort, 60 Hz while held: Pointer. Heard while `alive/pointer/ID` is there."""
        return self._key("pointer")

    @property
    def scene(self) -> str:
        """Query: the scene as JSON tables."""
        return self._key("scene")

    @property
    def clock(self) -> str:
        """Query: Clock."""
        return self._key("clock")

    @property
    def doctor(self) -> str:
        """Query: health as JSON."""
        return self._key("doctor")

    @property
    def panic(self) -> str:
        """Query: zero force at once, latched."""
        return self._key("panic")

    @property
    def set_many(self) -> str:
        """Query: a map of values, accepted or refused as a whole."""
        return self._key("set")

    def set_one(self, name: str) -> str:
        """Query: one value."""
        return self._key(f"set/{name}")

    @property
    def preset(self) -> str:
        """Query: every preset, as JSON. Put: PresetNews, when one was saved or loaded."""
        return self._key("preset")

    @property
    def preset_load(self) -> str:
        """Query: a name; its values are accepted or refused as a whole: PresetReply."""
        return self._key("preset/load")

    @property
    def preset_save(self) -> str:
        """Query: a name for what was accepted last: PresetNews."""
        return self._key("preset/save")

    @property
    def lease(self) -> str:
        """Query: LeaseRequest, or nothing to ask; answered by Lease. Put: Lease, when another holds it."""
        return self._key("lease")

    def param(self, name: str) -> str:
        """Put and query: Readback."""
        return self._key(f"param/{name}")

    def alive(self, service: str, instance: str) -> str:
        """Liveliness token."""
        return self._key(f"alive/{service}/{instance}")
