"""The whole way: every row says what binds it, and what nobody should choose has something better beside it."""

from typing import Any

import pytest

from drumstick_lab.accuracy import store, whole
from drumstick_lab.accuracy.choices import UNHEARD_JND, never


def row(choice: str, jnds: float, share: float, stage: str = "drum", late_ms: float | None = None) -> Any:
    return {
        "stage": stage, "playing": "roll", "choice": choice, "jnds": jnds, "share_of_core": share,
        "latency_ms": late_ms, "measures": [{"what": "spectrum", "jnds": jnds}],
    }  # fmt: skip


def test_nobody_should_choose_what_is_dearer_and_no_truer() -> None:
    cheap, true, bad = row("cheap", 3.0, 0.01), row("true", 0.5, 0.1), row("bad", 3.5, 0.2)
    assert never([cheap, true, bad]) == [(bad, cheap)]
    assert never([cheap, true, row("bad", 3.5, 0.2, "servo")]) == []


def test_nobody_should_choose_what_costs_as_much_and_is_half_as_true() -> None:
    true, bad = row("true", 0.5, 0.1), row("bad", 1.2, 0.1)
    assert never([true, bad]) == [(bad, true)]
    assert never([true, row("nearly", 0.9, 0.1)]) == []


def test_what_the_servo_refuses_is_no_better_choice() -> None:
    refused, dear = row("refused", 0.1, 0.01) | {"refused": True}, row("dear", 0.1, 0.1)
    assert never([refused, dear]) == []
    assert never([refused | {"refused": False}, dear]) == [(dear, refused | {"refused": False})]


def test_truer_than_can_be_told_is_no_reason() -> None:
    enough, finest = row("enough", 0.8 * UNHEARD_JND, 0.01), row("finest", 1e-6, 0.1)
    assert never([enough, finest]) == [(finest, enough)]


def test_what_is_truer_in_one_measure_is_a_choice() -> None:
    """A stream of a fast arm is truer in the low bands alone, and costs more."""
    message, stream = row("analytic", 0.9, 0.01, "message"), row("streamed", 11.0, 0.1, "message")
    for each, low in ((message, 0.6), (stream, 0.3)):
        each["measures"].append({"what": "spectrum below 1 kHz", "jnds": low})
    assert never([message, stream]) == []
    stream["measures"][-1]["jnds"] = 7.0
    assert never([message, stream]) == [(stream, message)]


def test_a_message_that_guesses_at_the_hand_beats_no_stream() -> None:
    message, stream = row("analytic", 4.0, 0.01, "message"), row("streamed", 15.0, 0.1, "message")
    assert never([message | {"guesses": True}, stream | {"guesses": False}]) == []


def test_what_is_later_does_not_make_up_for_it() -> None:
    soon, late = row("soon", 0.5, 0.1, late_ms=1.0), row("late", 0.5, 0.01, late_ms=9.0)
    assert never([soon, late]) == []


def test_the_shipped_rows_are_whole() -> None:
    found = store.shipped()["whole"]
    assert {"stick", "servo", "message", "reference", "drum", "output"} <= {
        each["stage"] for each in found["rows"]
    }
    assert "roll" in found["playings"]
    assert set(found["playings"]) <= set(whole.PLAYINGS)
    assert {"press", "accents", "snare", "timpani"} <= set(found["playings"])
    messages = {(each["playing"], each["choice"]) for each in found["rows"] if each["stage"] == "message"}
    assert {("a press roll", "analytic"), ("a press roll", "streamed, 4000 Hz")} <= messages
    assert {
        ("a blow by a wooden mallet", "mallet"),
        ("a blow by a felt mallet on a timpano", "mallet"),
    } <= messages
    exact = {each["playing"] for each in found["rows"] if "closed form" in each["choice"]}
    assert exact == {*whole.PLAIN, whole.LOSSY}
    assert [each["rate_Hz"] for each in found["streams"]["rows"]] == [1000.0, 4000.0]
    for each in found["rows"]:
        if each["stage"] == "drum":
            assert each["memory_bytes"] > 100_000
            assert 0.0 < each["latency_ms"] < 3.0
        assert each["jnds"] == max(measure["jnds"] for measure in each["measures"])
        assert each["binds"] in [
            measure["what"] for measure in each["measures"] if measure["jnds"] == each["jnds"]
        ]


@pytest.mark.long
def test_a_finer_mesh_is_nearer_and_dearer() -> None:
    rows = {each["choice"].partition(",")[0]: each for each in whole.drums("roll") if each["stage"] == "drum"}
    for coarse, fine in (("draft", "standard"), ("standard", "fine")):
        assert rows[fine]["jnds"] < rows[coarse]["jnds"]
        assert rows[fine]["memory_bytes"] > rows[coarse]["memory_bytes"]
