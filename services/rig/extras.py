"""Extras of the distribution: what one brings, and the line to type where something of it is missing. Any thread."""

import re
import sys
from importlib import metadata
from importlib.util import find_spec

from rig.exit_status import unavailable

_DISTRIBUTION = "haptic-drumstick"


def is_installed(requirement: str) -> bool:
    """True when the distribution that `requirement` names is there, in whatever version."""
    name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def requirements(extra: str) -> list[str]:
    """Requirements that `extra` brings, as the installed distribution declares it: "viser<1.2,>=1.1"."""
    declared = (line.partition(";") for line in metadata.requires(_DISTRIBUTION) or [])
    return [
        requirement.strip() for requirement, _, condition in declared if f"extra == '{extra}'" in condition
    ]


def what_to_type(extra: str) -> str:
    """Line to type where something that `extra` brings is missing; empty where all of it is there."""
    lacking = [each for each in requirements(extra) if not is_installed(each)]
    if not lacking:
        return ""
    # Environments that uv makes, those of uvx too, have no pip of their own.
    pip = (
        f"{sys.executable} -m pip install"
        if find_spec("pip")
        else f"uv pip install --python {sys.executable}"
    )
    return f"{pip} " + " ".join(f"'{each}'" for each in lacking)


def require(what: str, extra: str) -> None:
    """Stop with status 3 and the line to type unless all that `extra` brings is there, which `what` needs."""
    if line := what_to_type(extra):
        unavailable(f"{what} needs what is not installed; type: {line}")
