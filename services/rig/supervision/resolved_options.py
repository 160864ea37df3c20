"""Options from command line and rig file together. The command line wins; what neither says stays on loopback."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC
from protocol.endpoint import host_and_port, is_every_address, is_loopback, is_tls
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER
from protocol.osc import DEFAULT_IN
from protocol.session import Public
from rig import checks
from rig.exit_status import LACKING, CommandError, usage_error
from rig.identity import identity_check
from rig.identity.rig_file import RigFile, load
from rig.supervision.parts import ACCESS, PANEL, SOUND
from rig.supervision.parts import HAPTIC as HAPTIC_PART

_ROLES_OF = {HAPTIC_PART: (HAPTIC,), SOUND: ("sound",), PANEL: ("panel",)}


class ResolvedOptions(NamedTuple):
    """Endpoints and identity of a rig: where it listens, connects and sends, and as whom."""

    rig: str
    connect: str | None
    listen: str
    public: Public | None
    identity: Identity | None  # of clients: None where they stay on loopback
    osc_bind: tuple[str, int]
    osc_targets: tuple[str, ...]
    osc_allow: tuple[str, ...]  # empty: loopback
    panel_lan: tuple[str, int | None] | None = (
        None  # what the rig file says; None: the page stays on loopback
    )


def resolve(
    parts: frozenset[str],
    rig_file: Path | None,
    *,
    rig: str | None = None,
    connect: str | None = None,
    listen: str | None = None,
    osc_in: int | None = None,
    osc_out: Sequence[str] | None = None,
) -> ResolvedOptions:
    """Resolve the options of the services in `parts`. Raises CommandError; warns of certificates that end soon, or
    have ended.

    No force waits for a network: what time can mend, a certificate or a clock, ends no start that the force loop or its
    gateway is part of, and nobody asks here for the addresses of names.
    """
    file = RigFile() if rig_file is None else load(rig_file)
    name = checks.rig_name(rig or file.name or DEFAULT_RIG)
    end = connect or file.connect
    checks.endpoint(end)
    at = listen or DEFAULT_ROUTER
    checks.endpoint(at, "--listen")
    if osc_in is not None:
        checks.port(osc_in, "--osc-in")
    host, port = file.osc_bind or DEFAULT_IN
    targets = (
        tuple(osc_out)
        if osc_out
        else file.osc_targets
        if file.osc_targets is not None
        else (checks.DEFAULT_TARGET,)
    )
    for target in osc_out or ():
        checks.target(target)
    if end is None and parts & {HAPTIC_PART, ACCESS}:
        require_loopback(at)
    return ResolvedOptions(
        name,
        end,
        at,
        _public(file, name, at, parts) if ACCESS in parts and end is None else None,
        _identity(file, end, parts),
        (host, osc_in or port),
        targets,
        file.osc_allow or (),
        file.panel_lan,
    )


def _identity(file: RigFile, connect: str | None, parts: frozenset[str]) -> Identity | None:
    if connect is None or not is_tls(connect) or parts <= {ACCESS}:
        return None
    identity = identity_check.require_identity(connect, file.identity)
    if len(parts - {ACCESS}) > 1:
        usage_error(
            f"{connect}: over TLS each part needs a certificate of its own: start drumstick haptic, sound or panel,"
            " each with its rig file"
        )
    (part,) = parts - {ACCESS}
    _judge(lambda: identity_check.require_client(identity, _ROLES_OF[part], f"drumstick {part}"), parts)
    return identity


def _public(file: RigFile, rig: str, listen: str, parts: frozenset[str]) -> Public | None:
    inner, inner_port = host_and_port(listen)
    if file.public is None or file.identity is None:
        return None
    host, port = host_and_port(file.public)
    if port == inner_port and (is_every_address(host) or host == inner):
        usage_error(
            f"zenoh.public {file.public}: port {port} is that of --listen {listen}, and this address includes it;"
            f" take another, e.g. {port + 1}"
        )
    identity = file.identity
    _judge(lambda: identity_check.require_listener(identity), parts)
    return Public(file.public, identity, (rig, *file.also), file.roles)


def _judge(check: Callable[[], list[str]], parts: frozenset[str]) -> None:
    try:
        identity_check.warn(check())
    except CommandError as stop:
        if stop.status != LACKING or HAPTIC_PART not in parts:
            raise
        identity_check.warn([f"{stop}; nobody comes in or goes out by it until then"])


def require_loopback(listen: str) -> None:
    """Stop when others than local processes could come in at a router without access rules."""
    if is_tls(listen) or not is_loopback(host_and_port(listen)[0]):
        usage_error(
            f"--listen {listen}: whoever comes in there may do everything, so it must be a loopback address over TCP,"
            f" e.g. {DEFAULT_ROUTER}; other machines come in by zenoh.public of a rig file (docs/security.md)"
        )
