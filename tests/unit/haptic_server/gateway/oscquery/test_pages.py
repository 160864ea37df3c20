"""HTTP questions and their answers: whole nodes, single attributes, and everything that is wrong."""

import json
from http import HTTPStatus

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haptic_server.gateway.oscquery.pages import MAX_QUESTION, Page, page
from haptic_server.gateway.oscquery.tree import ATTRIBUTES, NOT_OFFERED, tree_of
from haptic_server.gateway.oscquery.values import Values
from osc_bench import FakeParameters
from protocol import osc

PARAMETERS = FakeParameters()
ROOT = tree_of("/drumstick", PARAMETERS.table)
HOST = {"NAME": "drumstick main"}


def ask(target: str, values: Values | None = None) -> Page:
    return page(ROOT, (values or Values(PARAMETERS)).snapshot(), target, HOST)


def told(target: str, values: Values | None = None) -> dict[str, object]:
    answer = ask(target, values)
    assert answer.status is HTTPStatus.OK, answer
    return json.loads(answer.body)


def test_the_root_tells_the_whole_tree() -> None:
    root = told("/")
    assert root["FULL_PATH"] == "/"
    assert root["ACCESS"] == 0
    param = told("/drumstick/param")
    contents = root["CONTENTS"]["drumstick"]["CONTENTS"]["param"]  # type: ignore[index]
    assert contents == param
    assert list(param["CONTENTS"]) == list(PARAMETERS.table)  # type: ignore[call-overload]


@pytest.mark.parametrize("target", ["/drumstick/param/", "/drumstick/param#x", "/%64rumstick/param"])
def test_other_ways_to_write_an_address(target: str) -> None:
    assert told(target) == told("/drumstick/param")


def test_values_are_the_desks_in_both_forms() -> None:
    for name, value in PARAMETERS.values().items():
        assert told(f"/drumstick/param/{name}?VALUE") == {"VALUE": [value]}
        norm = PARAMETERS.table[name].norm(value)
        assert told(f"/drumstick/param/{name}/norm?VALUE") == {"VALUE": [pytest.approx(norm)]}


def test_a_parameter_without_a_value_has_none() -> None:
    parameters = FakeParameters()
    parameters.lose_z_h0()
    assert told("/drumstick/param/z_h0?VALUE", Values(parameters)) == {}
    assert "VALUE" not in told("/drumstick/param/z_h0", Values(parameters))


def test_what_was_sent_last_is_the_value() -> None:
    values = Values(PARAMETERS)
    assert told("/drumstick/strike?VALUE", values) == {}
    assert values.note(osc.strike("/drumstick", 3, 0.5, -0.25, 1.5, 0.75, 12.5)) == "/drumstick/strike"
    assert told("/drumstick/strike?VALUE", values) == {"VALUE": [3, 0.5, -0.25, 1.5, 0.75, 12.5]}
    assert values.note(b"no message") == ""


def test_single_attributes() -> None:
    path = "/drumstick/param/tau"
    quantity = PARAMETERS.table["tau"].quantity
    assert told(f"{path}?RANGE") == {"RANGE": [{"MIN": quantity.low, "MAX": quantity.high}]}
    assert told(f"{path}?TYPE") == {"TYPE": "f"}
    assert told(f"{path}?UNIT") == {"UNIT": ["time.second"]}
    assert told(f"{path}?CLIPMODE") == {"CLIPMODE": ["none"]}
    assert told(f"{path}?FULL_PATH") == {"FULL_PATH": path}
    assert told(f"{path}?CONTENTS") == {"CONTENTS": {"norm": told(f"{path}/norm")}}
    for attribute in ATTRIBUTES:
        whole = told(path)
        assert told(f"{path}?{attribute}") == ({attribute: whole[attribute]} if attribute in whole else {})


def test_a_container_has_neither_type_nor_range_nor_value() -> None:
    assert told("/drumstick?TYPE") == {}
    assert told("/drumstick?RANGE") == {}
    assert ask("/drumstick?VALUE").status is HTTPStatus.NO_CONTENT


@pytest.mark.parametrize("path", ["/drumstick/panic", "/drumstick/sync", "/drumstick/subscribe"])
def test_what_can_only_be_written_has_no_value(path: str) -> None:
    assert ask(f"{path}?VALUE") == Page(HTTPStatus.NO_CONTENT)
    assert "VALUE" not in told(path)


def test_host_info_wherever_it_is_asked() -> None:
    for path in ("/", "/drumstick", "/nowhere"):
        assert told(f"{path}?HOST_INFO") == HOST


@pytest.mark.parametrize("attribute", NOT_OFFERED)
def test_an_attribute_of_the_proposal_that_is_not_offered(attribute: str) -> None:
    assert ask(f"/drumstick?{attribute}").status is HTTPStatus.NO_CONTENT


@pytest.mark.parametrize(
    "query", ["NONSENSE", "value", "VALUE&RANGE", "VALUE=1", "%ff", "VALUE ", "../VALUE"]
)
def test_an_unknown_attribute_is_a_bad_request(query: str) -> None:
    assert ask(f"/drumstick?{query}").status is HTTPStatus.BAD_REQUEST


@pytest.mark.parametrize(
    "path",
    [
        "/x",
        "/drumstick/param/x",
        "/drumstick//param",
        "/../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/*",
        "//",
    ],
)
def test_an_unknown_address_is_not_found(path: str) -> None:
    expected = HTTPStatus.OK if path == "//" else HTTPStatus.NOT_FOUND  # slashes at the end do not count
    assert ask(path).status is expected


@pytest.mark.parametrize("target", ["", "drumstick", "*", "http://elsewhere/", "/%ff", "/\ud800"])
def test_what_is_no_address_is_a_bad_request(target: str) -> None:
    assert ask(target).status is HTTPStatus.BAD_REQUEST


def test_a_question_that_is_too_long() -> None:
    assert ask("/" + "a" * MAX_QUESTION).status is HTTPStatus.REQUEST_URI_TOO_LONG


@given(st.text(max_size=60), st.text(max_size=20))
def test_any_question_has_an_answer(path: str, query: str) -> None:
    answer = ask(f"/{path}?{query}")
    assert answer.status in (
        HTTPStatus.OK,
        HTTPStatus.NO_CONTENT,
        HTTPStatus.BAD_REQUEST,
        HTTPStatus.NOT_FOUND,
    )
    if answer.status is HTTPStatus.OK:
        json.loads(answer.body)
