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


def command(words: str, rig: str) -> str:
    """Command to type about this rig: there may be several on one machine."""
    return f"drumstick {words}" if rig == DEFAULT_RIG else f"drumstick {words} --rig {rig}"


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
        """Each strike, at the tick that saw the contact."""
        return self._key("strike")

    @property
    def release(self) -> str:
        """The end of each contact."""
        return self._key("release")

    @property
    def choke(self) -> str:
        """A player stops the drum."""
        return self._key("choke")

    @property
    def contact(self) -> str:
        """The force within each contact, while the scene streams and somebody subscribes."""
        return self._key("contact")

    @property
    def state(self) -> str:
        """State of the servo, 30 times a second."""
        return self._key("state")

    @property
    def meter(self) -> str:
        """State of a sound server, 10 times a second; put by the sound server."""
        return self._key("meter")

    @property
    def membrane(self) -> str:
        """The head's surface, 30 times a second; put by the sound server while somebody subscribes."""
        return self._key("membrane")

    @property
    def spectrum(self) -> str:
        """The spectrum of what the drum sounds, 4 times a second; put by the sound server while somebody subscribes."""
        return self._key("spectrum")

    @property
    def cost(self) -> str:
        """Cost of the drum at each accuracy, once a second; put by the sound server while somebody subscribes."""
        return self._key("cost")

    @property
    def pointer(self) -> str:
        """Wanted place of the simulated stick, best effort, at 60 Hz. Heard while `alive/pointer/ID` is there."""
        return self._key("pointer")

    @property
    def scene(self) -> str:
        """The scene as JSON tables."""
        return self._key("scene")

    @property
    def scene_load(self) -> str:
        """Play another shipped scene, or next or previous of the set list. Refused in a panic or a fault."""
        return self._key("scene/load")

    @property
    def clock(self) -> str:
        """The haptic machine's monotonic time, for round trips."""
        return self._key("clock")

    @property
    def doctor(self) -> str:
        """Health as JSON: what the servo asked of the system and got, OSC counters."""
        return self._key("doctor")

    @property
    def door(self) -> str:
        """The public listener as JSON: who is in by which role, what was turned away. Nobody answers without one."""
        return self._key("door")

    @property
    def play_strike(self) -> str:
        """Strike the drum without the stick: at x, y (-1..1 of the radius), with a level of 0..1."""
        return self._key("play/strike")

    @property
    def play_choke(self) -> str:
        """Stop the drum: what rings fades in 30 ms, and the next strike sounds as always."""
        return self._key("play/choke")

    @property
    def play_rate(self) -> str:
        """Rate of the roll, Hz (0: none): put after every accepted change; a query asks for it, or for another one."""
        return self._key("play/rate")

    @property
    def play_level(self) -> str:
        """Level of the roll, 0 .. 1 (0: none): put after every accepted change; a query asks for it, or for another."""
        return self._key("play/level")

    @property
    def play_roll(self) -> str:
        """A map with the rate, the level or both of a roll, and the seconds to it; accepted or refused as a whole."""
        return self._key("play/roll")

    @property
    def panic(self) -> str:
        """Cut all force until `drumstick arm` on the haptic machine, its reboot or a new `drumstick up` or `haptic`."""
        return self._key("panic")

    @property
    def set_many(self) -> str:
        """A map of values, accepted or refused as a whole."""
        return self._key("set")

    def set_one(self, name: str) -> str:
        """One value."""
        return self._key(f"set/{name}")

    @property
    def preset(self) -> str:
        """A query gives every preset, as JSON; put when one was saved, loaded, renamed or deleted."""
        return self._key("preset")

    @property
    def preset_load(self) -> str:
        """Set everything that the preset of this name holds, or nothing."""
        return self._key("preset/load")

    @property
    def preset_save(self) -> str:
        """Keep what was accepted last under this name."""
        return self._key("preset/save")

    @property
    def preset_rename(self) -> str:
        """Give a preset another name, which no other preset has. Refused beside somebody else's lease."""
        return self._key("preset/rename")

    @property
    def preset_delete(self) -> str:
        """Delete the preset of this name, and the version before it. Refused beside somebody else's lease."""
        return self._key("preset/delete")

    @property
    def lease(self) -> str:
        """Take, renew, give back the right to be the only one who sets, or ask who has it; put when that changes."""
        return self._key("lease")

    def param(self, name: str) -> str:
        """One parameter as the servo uses it: put after every accepted change; `param/*` asks for all."""
        return self._key(f"param/{name}")

    def alive(self, service: str, instance: str) -> str:
        """Presence of a service: haptic, sound, panel, record, pointer."""
        return self._key(f"alive/{service}/{instance}")
