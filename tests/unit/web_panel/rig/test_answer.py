from protocol.messages import PresetReply, Readback, RefusalReply, SetReply, encode
from web_panel.rig.answer import accepted, all_accepted, loaded, refused


def test_the_reply_to_one_value_and_to_several_are_both_read() -> None:
    readback = Readback(value=0.3, revision=4, pending=True)
    assert accepted("dv_pls", encode(readback)).readbacks == {"dv_pls": readback}
    several = SetReply(values={"dv_pls": 0.3, "tau": 0.002}, revision=4, pending=True)
    assert accepted("dv_pls", encode(several)).readbacks["dv_pls"] == readback
    assert all_accepted(encode(several)).readbacks.keys() == {"dv_pls", "tau"}
    preset = PresetReply(
        name="slow", values={"tau": 0.002}, revision=4, pending=False, note="an older version"
    )
    answer = loaded(encode(preset))
    assert (answer.readbacks, answer.words) == (
        {"tau": Readback(value=0.002, revision=4)},
        "an older version",
    )


def test_an_answer_that_cannot_be_read_is_not_taken_for_yes() -> None:
    for payload in (b"", b"\xc1", encode(Readback(value=float("nan"), revision=1))):
        answer = accepted("dv_pls", payload)
        assert not answer.taken
        assert answer.words.startswith("Not confirmed: the haptic server's answer could not be read")


def test_a_refusal_keeps_its_words() -> None:
    assert refused(encode(RefusalReply(reason="too much"))).reason == "too much"
    assert refused(encode(RefusalReply(reason="too much"))).words == "Refused: too much"
    assert refused(encode(RefusalReply(reason="too much"))).words_about("3 m/s") == "Refused, 3 m/s: too much"
    assert refused(b"plain words").words == "Refused: plain words"
    assert refused(b"").words == "Refused: no reason given"
