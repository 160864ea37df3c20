"""Access rules of a router on a machine of its own, made from the same table of roles as the public listener's.

There the gateway is a client too, by its certificate `haptic`: it alone may do everything below its rigs' keys. Nobody
is local: a link without a certificate gets nothing through.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from protocol.access.roles import HAPTIC, ROLES
from protocol.access.rules import EVERY_MESSAGE, Rule, role_rules, rule
from protocol.keys import checked_rig

ROUTER = "router"  # the common name of a router's own certificate
_OTHER_WAY = {"ingress": "egress", "egress": "ingress"}


class Crossing(NamedTuple):
    """Rigs whose play passes between two venues: ours to the far router, theirs to us."""

    ours: tuple[str, ...] = ()
    theirs: tuple[str, ...] = ()


def router_access(rigs: Sequence[str], roles: Sequence[str], crossing: Crossing | None = None) -> Rule:
    """Zenoh's `access_control`. `rigs` play here; what comes by `crossing` may be followed here, and not be set."""
    crossing = crossing or Crossing()
    for rig in (*rigs, *crossing.ours, *crossing.theirs):
        checked_rig(rig)
    below = [f"drumstick/{rig}/{tail}" for rig in rigs for tail in ("**", "**/@adv/**")]
    parts = {HAPTIC: [rule(f"{HAPTIC} {flow}", flow, EVERY_MESSAGE, below) for flow in _OTHER_WAY]}
    for name in roles:
        parts[name] = role_rules(name, ROLES[name], rigs)
        if crossing.theirs:
            parts[name] += role_rules(f"{name} of the other venue", ROLES["listener"], crossing.theirs)
    if crossing.ours:
        # The far router is a listener of ours ...
        parts[ROUTER] = role_rules("far router", ROLES["listener"], crossing.ours)
    if crossing.theirs:
        # ... and towards it we are one: the same rules in the other direction.
        mirrored = role_rules("to far router", ROLES["listener"], crossing.theirs)
        parts.setdefault(ROUTER, []).extend(
            {**each, "flows": [_OTHER_WAY[flow] for flow in _flows(each)]} for each in mirrored
        )
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [each for rules in parts.values() for each in rules],
        "subjects": [
            {"id": name, "link_protocols": ["tls"], "cert_common_names": [name]} for name in parts
        ],
        "policies": [
            {"rules": [each["id"] for each in rules], "subjects": [name]} for name, rules in parts.items()
        ],
    }  # fmt: skip


def _flows(each: Rule) -> list[str]:
    flows = each["flows"]
    assert isinstance(flows, list)
    return [str(flow) for flow in flows]  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
