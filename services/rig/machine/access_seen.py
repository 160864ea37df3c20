"""Findings of `drumstick doctor --rig-file`: this machine's certificate, and connections the running rig rejected."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from protocol.access.roles import HAPTIC, ROLES
from protocol.foreign_text import shown
from protocol.keys import DEFAULT_RIG
from rig.exit_status import CommandError
from rig.identity import identity_check
from rig.identity.rig_file import load
from rig.machine.finding import Finding
from rig.network import remote
from rig.network.remote_rig import remote_rig


def rig_of(rig_file: Path | None, rig: str | None) -> str:
    """The rig that is meant; a rig file that cannot be read is a finding of its own."""
    try:
        named = None if rig_file is None else load(rig_file).name
    except CommandError:
        named = None
    return rig or named or DEFAULT_RIG


def findings(rig_file: Path, rig: str | None) -> list[Finding]:
    """Findings about the rig file, and about its rig if that runs. Talks to nobody but the file's own rig."""
    try:
        warnings = _fitness(rig_file)
    except CommandError as stop:
        return [
            Finding("rig file", False, True, str(stop), "docs/security.md says how keys are made and carried")
        ]
    found = "; ".join(warnings) or f"{rig_file}: its certificate is good"
    own = Finding("rig file", not warnings, False, found)
    try:
        gateway, public = remote.health(remote_rig(rig_file, rig, None))
    except CommandError as stop:
        return [
            own,
            Finding("rig", False, False, str(stop), "rejected connections are known only while a rig runs"),
        ]
    return [own, *_findings(gateway, public)]


def _fitness(rig_file: Path) -> list[str]:
    # Warnings about this machine's certificate, whatever its role. Raises CommandError when it is fit for nothing.
    file = load(rig_file)
    if file.identity is None:
        return []
    if file.public is not None:
        return identity_check.require_listener(file.identity)
    return identity_check.require_client(file.identity, (HAPTIC, *ROLES), "a rig")


def _findings(gateway: dict[str, Any], public: dict[str, Any] | None) -> list[Finding]:
    by_osc = gateway.get("osc", {}).get("source", 0)  # a replay has no OSC to hear
    osc = Finding(
        "OSC strangers",
        not by_osc,
        False,
        f"{by_osc} messages refused",
        "add their addresses to osc.allow if they may play",
    )
    if public is None:
        return [Finding("public listener", True, False, "none: loopback only"), osc]
    here = ", ".join(f"{shown(name)} {n}x" for name, n in sorted(public["present"].items())) or "nobody"
    failed, roleless = public["handshakes_refused"], public["without_role"]
    beyond = ", ".join(f"{shown(role)} {n}x" for role, n in sorted(public["beyond_role"].items())) or "none"
    over = (
        ", ".join(f"{shown(role)} {n}x" for role, n in sorted(public.get("over_limit", {}).items())) or "none"
    )
    words = (
        f"{shown(public['endpoint'])}; here now: {here}; refused {failed} handshakes, {roleless} without a role;"
        f" messages beyond the sender's role: {beyond}; sessions ended beyond a limit: {over},"
        f" turned back since: {sum(public.get('turned_back', {}).values())}x"
    )
    good = (
        bool(public["is_open"])
        and not failed
        and not roleless
        and not public["beyond_role"]
        and over == "none"
    )
    last = (
        f"last: {shown(public['last'], 300)}"
        if public["last"]
        else "its address or port cannot be had; it is tried again"
    )
    return [Finding("public listener", good, False, words, last), osc]
