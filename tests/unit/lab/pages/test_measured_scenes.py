"""The sentence beside the table of scenes says what its rows say."""

from typing import Any

from drumstick_lab.pages.measured.measured_scenes import drawn_beside_listed


def _row(listed: list[str], drawn: list[str]) -> dict[str, Any]:
    return {"listed": listed, "drawn": {"values": drawn}}


def test_a_control_that_the_scene_does_not_call_for_is_told() -> None:
    rows = {"roll": _row(["m", "tau"], ["level", "m", "rate", "tau"]), "offline": {}}
    assert "for no other: in every scene." in drawn_beside_listed(rows)
    rows |= {"bare": _row(["m"], ["m", "tau"]), "snare": _row(["m", "strainer"], ["m"])}
    assert "for no other: BUT FOR `bare` (tau), `snare` (strainer)." in drawn_beside_listed(rows)
    assert drawn_beside_listed({"offline": {}}) == "What the pages draw was not measured."
