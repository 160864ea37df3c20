"""The access rules of the rig's router, in Zenoh's own form, made from the table of roles.

Local processes come in over plain TCP on a loopback address and may do everything. Everybody else comes in over TLS
with a certificate of the rig's authority, and may do what its common name's role may. Nothing else is permitted: a
link that is neither, or a certificate of another name, gets nothing through.
"""

from collections.abc import Sequence

from protocol.access.roles import ROLES, Role
from protocol.keys import checked_rig

EVERY_MESSAGE = (
    "put", "delete", "declare_subscriber", "query", "reply", "declare_queryable",
    "liveliness_token", "liveliness_query", "declare_liveliness_subscriber",
)  # fmt: skip
# `**` stands for no part that begins with @: advanced publishers keep their caches below such a one.
_EVERY_KEY: list[str] = ["**", "**/@adv/**"]

Rule = dict[str, object]


def rule(ident: str, flow: str, messages: tuple[str, ...], keys: list[str]) -> Rule:
    """One rule that permits these messages on these keys; `flow` is ingress or egress."""
    return {
        "id": ident, "permission": "allow", "flows": [flow], "messages": list(messages), "key_exprs": keys,
    }  # fmt: skip


def role_rules(name: str, role: Role, rigs: Sequence[str]) -> list[Rule]:
    """Rights of the owner of `role` over these rigs, each rule named `name` and what it permits."""

    # Ingress is what comes from the role's owner, egress what goes to him.
    def below(tails: tuple[str, ...]) -> list[str]:
        return [f"drumstick/{rig}/{tail}" for rig in rigs for tail in tails]

    # A publisher that is told of no subscriber sends nothing. Whoever may put is told of all of them, or he would not
    # learn of one who listens to `drumstick/**`; of a subscriber only his pattern is told.
    subscribers = _EVERY_KEY if role.publishes else []
    # Whoever may look may look for all rigs at once, not to have to know their names; of the carried ones he is shown.
    looked_for = [f"drumstick/*/{tail}" for tail in role.sees]
    wanted = (
        ("hears", "ingress", ("declare_subscriber",), below(role.subscribes)),
        ("is told", "egress", ("put",), below(role.subscribes)),
        ("asks", "ingress", ("query",), below(role.asks)),
        ("is answered", "egress", ("reply", "declare_queryable"), below(role.asks)),
        ("tells", "ingress", ("put",), below(role.publishes)),
        ("is heard", "egress", ("declare_subscriber",), subscribers),
        ("is seen", "ingress", ("liveliness_token",), below(role.is_seen_as)),
        ("sees", "ingress", ("liveliness_query", "declare_liveliness_subscriber"), looked_for),
        ("is shown", "egress", ("liveliness_token",), below(role.sees)),
    )
    return [rule(f"{name} {what}", flow, messages, keys) for what, flow, messages, keys in wanted if keys]


def access_control(rigs: Sequence[str], roles: Sequence[str]) -> dict[str, object]:
    """Zenoh's `access_control` for a router that carries `rigs` and admits `roles`.

    Every policy names only rules and subjects that are here: what else it named, Zenoh would pass over in silence.
    """
    for rig in rigs:
        checked_rig(rig)
    rules = [rule(f"local {flow}", flow, EVERY_MESSAGE, _EVERY_KEY) for flow in ("ingress", "egress")]
    subjects: list[Rule] = [{"id": "local", "link_protocols": ["tcp"]}]
    policies: list[Rule] = [{"rules": ["local ingress", "local egress"], "subjects": ["local"]}]
    for name in roles:
        own = role_rules(name, ROLES[name], rigs)
        rules += own
        subjects.append({"id": name, "link_protocols": ["tls"], "cert_common_names": [name]})
        policies.append({"rules": [each["id"] for each in own], "subjects": [name]})
    return {
        "enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies,
    }  # fmt: skip
