"""Names of rigs with a star in them."""

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from protocol.keys import Keys
from protocol.pattern import Presence, alive_key, checked_pattern, is_pattern, presence_of

NAMES = st.from_regex(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,39}", fullmatch=True)


@pytest.mark.parametrize("text", ["", ".a*", "a/*", "*/*", "a?*", "$*", "*" * 41, "..", "a b"])
def test_what_could_leave_its_place_in_a_key_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="use 1 to 40 letters"):
        checked_pattern(text)


@pytest.mark.parametrize(
    ("pattern", "meant", "others"),
    [
        ("stage-*", ["stage-left", "stage-", "stage-1.b"], ["stage", "backstage-1", "main"]),
        ("*", ["main", "stage-left"], []),
        ("**", ["main"], []),
        ("*-2-*", ["a-2-b", "-2-"], ["a-2", "main"]),
        ("a**b", ["ab", "axb"], ["abc"]),
    ],
)
def test_zenoh_finds_the_rigs_that_a_pattern_stands_for(
    pattern: str, meant: list[str], others: list[str]
) -> None:
    assert is_pattern(checked_pattern(pattern))
    looked_for = zenoh.KeyExpr(alive_key(pattern, "haptic"))
    for rig in meant:
        assert looked_for.includes(zenoh.KeyExpr(Keys(rig).alive("haptic", "7f")))
        assert not looked_for.includes(zenoh.KeyExpr(Keys(rig).alive("sound", "7f")))
    for rig in others:
        assert not looked_for.intersects(zenoh.KeyExpr(Keys(rig).alive("haptic", "7f")))


@given(st.text("ab*-.", min_size=1, max_size=12))
def test_every_pattern_that_is_taken_is_a_key_in_zenohs_own_form(text: str) -> None:
    try:
        checked_pattern(text)
    except ValueError:
        return
    key = alive_key(text, "haptic")
    assert str(zenoh.KeyExpr(key)) == key
    assert zenoh.KeyExpr(alive_key()).includes(zenoh.KeyExpr(key))


@given(NAMES, st.sampled_from(["haptic", "sound"]))
def test_a_token_says_whose_service_it_is(rig: str, service: str) -> None:
    assert presence_of(Keys(rig).alive(service, "1f")) == Presence(rig, service, "1f")


@pytest.mark.parametrize(
    "key",
    [
        "drumstick/a/strike",
        "other/a/alive/haptic/1",
        "drumstick/.a/alive/haptic/1",
        "drumstick/a/alive/x/1/2",
        "",
    ],
)
def test_a_foreign_token_says_nothing(key: str) -> None:
    assert presence_of(key) is None
