from http import HTTPStatus

import pytest
from websockets.datastructures import Headers

from web_panel.access.admission import Admission
from web_panel.access.lan_admission import LIFE_H, LanAdmission
from web_panel.access.one_time_login import OneTimeLogin

TOKEN, OWN = "a" * 43, "192.168.1.10:8443"


class Clock:
    now_s = 1_800_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def lan(clock: Clock) -> LanAdmission:
    return LanAdmission(TOKEN, 8443, host="192.168.1.10", login=OneTimeLogin(), clock=clock)


def judge(admission: Admission, path: str = "/", host: str = OWN, **headers: str) -> HTTPStatus:
    return admission.judge(Headers({"Host": host, **headers}), path).status


def sent_back(cookie: str) -> dict[str, str]:
    """As a browser sends what was set."""
    return {"Cookie": cookie.partition(";")[0]}


def test_the_link_admits_once_and_its_cookie_from_then_on(lan: LanAdmission) -> None:
    lan.login.renew()
    path = lan.open_link.removeprefix(f"https://{OWN}")
    assert lan.judge(Headers({"Host": OWN}), path).by_address
    assert judge(lan, path) is HTTPStatus.UNAUTHORIZED
    assert lan.open_link == ""
    assert judge(lan, path, **sent_back(lan.cookie)) is HTTPStatus.OK  # the page is loaded again
    assert {"HttpOnly", "SameSite=Strict", "Secure"} <= set(lan.cookie.split("; "))


def test_a_cookie_ends_after_so_many_hours_whatever_the_browser_does(lan: LanAdmission, clock: Clock) -> None:
    cookie = sent_back(lan.cookie)
    clock.now_s += LIFE_H * 3600 - 1
    assert judge(lan, **cookie) is HTTPStatus.OK
    clock.now_s += 2
    assert judge(lan, **cookie) is HTTPStatus.UNAUTHORIZED


def test_a_cookie_cannot_be_made_longer(lan: LanAdmission) -> None:
    name, _, value = lan.cookie.partition(";")[0].partition("=")
    until, _, signature = value.partition(".")
    for forged in (f"{int(until) + 1}.{signature}", f"{until}.", until, ".", "", f"\xff.{signature}", TOKEN):
        assert judge(lan, Cookie=f"{name}={forged}") is HTTPStatus.UNAUTHORIZED


def test_what_admits_on_this_machine_admits_nobody_from_the_network_nor_the_other_way(
    lan: LanAdmission,
) -> None:
    near = Admission(TOKEN, 8443)
    assert judge(lan, f"/?token={TOKEN}") is HTTPStatus.UNAUTHORIZED
    assert judge(lan, f"/?login={TOKEN}") is HTTPStatus.UNAUTHORIZED
    assert judge(lan, **sent_back(near.cookie)) is HTTPStatus.UNAUTHORIZED
    secret = lan.login.renew()
    assert judge(near, f"/?token={secret}", "127.0.0.1:8443") is HTTPStatus.UNAUTHORIZED
    assert judge(near, f"/?login={secret}", "127.0.0.1:8443") is HTTPStatus.UNAUTHORIZED
    assert judge(near, host="127.0.0.1:8443", **sent_back(lan.cookie)) is HTTPStatus.UNAUTHORIZED


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8443", "localhost:8443", "192.168.1.10", "192.168.1.11:8443", "evil.example:8443", ""]
)
def test_another_name_is_misdirected_and_uses_up_no_link(lan: LanAdmission, host: str) -> None:
    secret = lan.login.renew()
    assert judge(lan, f"/?login={secret}", host) is HTTPStatus.MISDIRECTED_REQUEST
    assert lan.login.open_secret == secret


@pytest.mark.parametrize("origin", [f"http://{OWN}", "https://evil.example", "null", "https://192.168.1.10"])
def test_another_page_is_forbidden_and_uses_up_no_link(lan: LanAdmission, origin: str) -> None:
    secret = lan.login.renew()
    assert judge(lan, f"/?login={secret}", Origin=origin) is HTTPStatus.FORBIDDEN
    assert judge(lan, Origin=origin, **sent_back(lan.cookie)) is HTTPStatus.FORBIDDEN
    assert lan.login.open_secret == secret
    assert judge(lan, Origin=f"https://{OWN}", **sent_back(lan.cookie)) is HTTPStatus.OK


def test_the_usual_port_is_not_written() -> None:
    lan = LanAdmission(TOKEN, 443, host="192.168.1.10", login=OneTimeLogin())
    assert lan.address == "https://192.168.1.10/"
    assert judge(lan, host="192.168.1.10", **sent_back(lan.cookie)) is HTTPStatus.OK


def test_a_websocket_ends_with_the_cookie_that_it_came_with(lan: LanAdmission, clock: Clock) -> None:
    ends = clock.now_s + LIFE_H * 3600
    cookie = sent_back(lan.cookie)
    clock.now_s += 100.0
    assert lan.end_of(Headers(cookie)) == ends
    assert lan.end_of(Headers({"Cookie": f"{lan.cookie_name}={int(ends) + 50}.forged"})) == 0.0
    assert lan.end_of(Headers()) == ends + 100.0  # in by its link
