"""The access rules as Zenoh gets them: nothing dangling, nothing but the table of roles."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.access.roles import ROLES, checked_roles
from protocol.access.rules import access_control
from protocol.keys import Keys

KEYS = Keys("r")
EVERY_TAIL = {
    value.removeprefix("drumstick/r/")
    for value in (
        *(getattr(KEYS, name) for name, member in vars(Keys).items() if isinstance(member, property)),
        KEYS.set_one("*"),
        KEYS.param("*"),
        *(KEYS.alive(service, "*") for service in ("haptic", "sound", "panel", "record", "pointer", "*")),
    )
}
MAY_COME_IN = {"put", "query", "declare_subscriber", "liveliness_token"}
MAY_COME_IN |= {"liveliness_query", "declare_liveliness_subscriber"}


def rules_of(acl: dict[str, Any], subject: str) -> list[dict[str, Any]]:
    named = [r for p in acl["policies"] if subject in p["subjects"] for r in p["rules"]]
    return [rule for rule in acl["rules"] if rule["id"] in named]


def test_the_table_names_keys_that_there_are() -> None:
    named = {
        tail
        for r in ROLES.values()
        for tail in (*r.subscribes, *r.asks, *r.publishes, *r.is_seen_as, *r.sees)
    }
    assert named <= EVERY_TAIL


@given(
    rigs=st.lists(st.sampled_from(["main", "left", "right"]), min_size=1, max_size=3, unique=True),
    roles=st.lists(st.sampled_from(list(ROLES)), unique=True),
)
def test_every_policy_names_rules_and_subjects_that_are_there_and_every_rule_is_used(
    rigs: list[str], roles: list[str]
) -> None:
    acl: Any = access_control(rigs, roles)
    ids = [rule["id"] for rule in acl["rules"]]
    subjects = [subject["id"] for subject in acl["subjects"]]
    assert len(set(ids)) == len(ids)
    assert sorted(r for p in acl["policies"] for r in p["rules"]) == sorted(ids)
    assert sorted(s for p in acl["policies"] for s in p["subjects"]) == sorted(subjects)
    assert subjects == ["local", *roles]
    assert acl["enabled"] is True
    assert acl["default_permission"] == "deny"


@given(rigs=st.lists(st.sampled_from(["main", "left", "right"]), min_size=1, max_size=3, unique=True))
def test_what_comes_from_another_machine_is_never_an_answer_nor_on_another_rigs_key(rigs: list[str]) -> None:
    acl: Any = access_control(rigs, list(ROLES))
    for name in ROLES:
        for rule in rules_of(acl, name):
            assert rule["permission"] == "allow"
            assert len(rule["flows"]) == 1
            if rule["flows"] == ["ingress"]:
                assert set(rule["messages"]) <= MAY_COME_IN
            elif rule["messages"] == ["declare_subscriber"]:
                continue  # patterns of subscribers are no secret
            # Whoever looks for services may look for all rigs'; he is shown those of these rigs only.
            looks = set(rule["messages"]) == {"liveliness_query", "declare_liveliness_subscriber"}
            assert {key.split("/")[1] for key in rule["key_exprs"]} == ({"*"} if looks else set(rigs))
            assert all(key.startswith("drumstick/") and "**" not in key for key in rule["key_exprs"])


def test_only_plain_tcp_is_local_and_only_tls_has_a_role() -> None:
    acl: Any = access_control(["main"], list(ROLES))
    local, *others = acl["subjects"]
    assert local == {"id": "local", "link_protocols": ["tcp"]}
    for subject in others:
        assert subject["link_protocols"] == ["tls"]
        assert subject["cert_common_names"] == [subject["id"]]


def test_a_role_or_rig_that_is_none() -> None:
    with pytest.raises(ValueError, match="'sond' is no role; there is sound, panel"):
        checked_roles(["sond"])
    with pytest.raises(ValueError, match="letters, digits"):
        access_control(["a/**"], list(ROLES))
