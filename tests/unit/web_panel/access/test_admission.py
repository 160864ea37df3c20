from http import HTTPStatus

import pytest
from websockets.datastructures import Headers

from web_panel.access.admission import Admission

TOKEN = "a" * 43
ADMISSION = Admission(TOKEN, 8080)
COOKIE = {"Cookie": f"other=1; drumstick_panel_8080={TOKEN}"}


def judge(path: str = "/", *, host: str = "127.0.0.1:8080", **headers: str) -> HTTPStatus:
    return ADMISSION.judge(Headers({"Host": host, **headers}), path).status


def test_the_address_admits_and_asks_for_a_cookie() -> None:
    verdict = ADMISSION.judge(Headers({"Host": "127.0.0.1:8080"}), f"/?token={TOKEN}")
    assert verdict.status is HTTPStatus.OK
    assert verdict.by_address


def test_the_cookie_admits_and_is_kept_from_scripts_and_other_sites() -> None:
    assert judge(**COOKIE) is HTTPStatus.OK
    assert {"HttpOnly", "SameSite=Strict"} <= set(ADMISSION.cookie.split("; "))
    assert "Max-Age=2592000" in ADMISSION.cookie.split("; ")  # 30 days
    assert ADMISSION.cookie.startswith(f"drumstick_panel_8080={TOKEN};")


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/?token=",
        "/?token=b",
        f"/?token={TOKEN[:-1]}",
        f"/?token={TOKEN}a",
        f"/?tokens={TOKEN}",
        "/?token=%ff",
        "/?token=\udcff",
        "/?token=\u00e4",
        "//[",
    ],
)
def test_without_the_token_nobody_enters(path: str) -> None:
    assert judge(path) is HTTPStatus.UNAUTHORIZED


@pytest.mark.parametrize(
    "cookie",
    [
        "",
        "drumstick_panel_8080=b",
        f"drumstick_panel_8081={TOKEN}",
        f"x{TOKEN}",
        "=;=;",
        "drumstick_panel_8080=\xff",
    ],
)
def test_a_wrong_cookie_admits_nobody(cookie: str) -> None:
    assert judge(Cookie=cookie) is HTTPStatus.UNAUTHORIZED


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:8080",
        "127.0.0.1.evil.example",
        "192.168.0.2:8080",
        "",
        "localhost:80:80",
        "a@127.0.0.1",
    ],
)
def test_a_foreign_host_is_misdirected_even_with_the_token(host: str) -> None:
    assert judge(f"/?token={TOKEN}", host=host) is HTTPStatus.MISDIRECTED_REQUEST


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "LOCALHOST:9090", "127.0.0.1"]
)
def test_own_names_on_any_port_serve_a_tunnel(host: str) -> None:
    assert judge(f"/?token={TOKEN}", host=host) is HTTPStatus.OK


def test_no_host_or_two_hosts_are_misdirected() -> None:
    two = Headers()
    two["Host"] = "127.0.0.1:8080"
    two["Host"] = "evil.example"
    for headers in (Headers(), two):
        assert ADMISSION.judge(headers, f"/?token={TOKEN}").status is HTTPStatus.MISDIRECTED_REQUEST


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "https://127.0.0.1:8080",
        "http://127.0.0.1:9999",
        "http://localhost:8080",
        "",
    ],
)
def test_a_foreign_origin_is_forbidden_even_with_the_cookie(origin: str) -> None:
    assert judge(Origin=origin, **COOKIE) is HTTPStatus.FORBIDDEN


def test_the_pages_own_origin_is_welcome() -> None:
    assert judge(Origin="http://127.0.0.1:8080", **COOKIE) is HTTPStatus.OK
    assert judge(Origin="http://127.0.0.1:8080") is HTTPStatus.UNAUTHORIZED
