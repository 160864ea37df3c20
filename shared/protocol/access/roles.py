"""Roles on the network and their permissions: one table, by the common name of a certificate.

The router's access rules, the certificates that `drumstick keys make` makes, the page docs/security.md and the tests
are derived from it. What is not in a role's row is refused. Names of keys are those below `drumstick/<rig>/`.
"""

from dataclasses import dataclass

HAPTIC = "haptic"  # the haptic machine itself: the public listener's own certificate


@dataclass(frozen=True)
class Role:
    """Rights of the owner of one kind of certificate; everything else is refused."""

    words: str
    subscribes: tuple[str, ...] = ()  # may subscribe
    asks: tuple[str, ...] = ()  # may query
    publishes: tuple[str, ...] = ()  # may put
    is_seen_as: tuple[str, ...] = ()  # may declare these liveliness tokens
    sees: tuple[str, ...] = ()  # may look for these liveliness tokens, and is shown those of the carried rigs


ROLES: dict[str, Role] = {
    "sound": Role(
        "a machine that plays the drum",
        subscribes=("strike", "choke", "release", "contact", "state", "meter", "param/*"),
        asks=("scene", "clock", "param/*"),
        publishes=("meter", "membrane", "spectrum", "cost"),
        is_seen_as=("alive/sound/*",),
        sees=("alive/haptic/*",),
    ),
    "panel": Role(
        "the technician's page, run on another machine",
        subscribes=(
            "strike",
            "release",
            "state",
            "meter",
            "membrane",
            "spectrum",
            "cost",
            "param/*",
            "play/rate",
            "play/level",
            "preset",
            "lease",
        ),
        asks=(
            "set",
            "set/*",
            "param/*",
            "preset",
            "preset/load",
            "preset/save",
            "preset/rename",
            "preset/delete",
            "lease",
            "scene",
            "scene/load",
            "doctor",
            "door",
            "play/strike",
            "play/choke",
            "play/rate",
            "play/level",
            "play/roll",
            "panic",
        ),
        publishes=("pointer",),
        is_seen_as=("alive/panel/*",),
        sees=("alive/*/*",),
    ),
    "technician": Role(
        "`drumstick params`, `play`, `preset`, `rigs`, `doctor` and `panic` from another machine",
        subscribes=("state", "meter", "param/*", "play/rate", "play/level", "preset", "lease"),
        asks=(
            "set",
            "set/*",
            "param/*",
            "preset",
            "preset/load",
            "preset/save",
            "preset/rename",
            "preset/delete",
            "lease",
            "scene",
            "doctor",
            "door",
            "play/rate",
            "play/level",
            "play/roll",
            "panic",
        ),
        sees=("alive/*/*",),
    ),
    "listener": Role(
        "programs that only follow the play: light, video, `drumstick record`, `drumstick monitor`",
        subscribes=(
            "strike",
            "choke",
            "release",
            "state",
            "meter",
            "param/*",
            "play/rate",
            "play/level",
            "preset",
            "lease",
        ),
        asks=("param/*", "preset", "scene", "clock"),
        is_seen_as=("alive/record/*",),
        sees=("alive/*/*",),
    ),
}


def checked_roles(names: list[str] | tuple[str, ...]) -> tuple[str, ...]:
    """The names, each once, when each is a role that may come in; else ValueError."""
    for name in names:
        if name not in ROLES:
            raise ValueError(f"{name!r} is no role; there is {', '.join(ROLES)}")
    return tuple(dict.fromkeys(names))
