from protocol.messages import Readback, RefusalReply, SetReply, encode
from web_panel.answer import Answer, accepted, refused


def test_the_reply_to_one_value_and_to_several_are_both_read() -> None:
    readback = Readback(value=0.3, revision=4, pending=True)
    assert accepted("dv_pls", encode(readback)).readback == readback
    several = SetReply(values={"dv_pls": 0.3, "tau": 0.002}, revision=4, pending=True)
    assert accepted("dv_pls", encode(several)).readback == readback


def test_an_answer_that_cannot_be_read_is_not_taken_for_yes() -> None:
    for payload in (b"", b"\xc1", encode(Readback(value=float("nan"), revision=1))):
        answer = accepted("dv_pls", payload)
        assert not answer.taken
        assert answer.words.startswith("Not confirmed: the haptic server's answer could not be read")


def test_a_refusal_keeps_its_words() -> None:
    assert refused(encode(RefusalReply(reason="too much"))).reason == "too much"
    assert refused(encode(RefusalReply(reason="too much"))).words == "Refused: too much"
    assert refused(b"plain words").words == "Refused: plain words"
    assert refused(b"").words == "Refused: no reason given"


def test_yes_needs_no_words() -> None:
    assert Answer().taken
    assert Answer().words == ""
