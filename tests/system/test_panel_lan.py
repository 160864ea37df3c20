"""The page from the network (--panel-lan): a phone comes in by the one-time link over TLS, and nobody else comes in.

Another address of loopback stands for the network's: the panel knows only the address that it was given.
"""

import http.client
import re
import socket
import ssl

import pytest
from browser import DESKTOP, PHONE, opened, part, readback, slider, visitor
from fake_rig import FakeRig, wait_until
from lan_page import HOST, Opened
from panel_process import PanelProcess
from panel_wire import Visitor, dial_port
from playwright.sync_api import Browser, expect
from rig_process import PATIENCE_S, bound
from websockets.exceptions import InvalidStatus

pytestmark = pytest.mark.system


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


def labels(heard: Visitor) -> set[str]:
    return {str(part.get("props", {}).get("label")) for part in heard.parts.values()}


def test_it_says_what_it_opens_and_for_whom(lan: Opened) -> None:
    words, link, *code = lan.said
    assert f"{lan.origin}/" in words
    assert "all that this page does, for 12 hours" in words
    shown = ssl.PEM_cert_to_DER_cert(lan.certificate.read_text())
    with (
        socket.create_connection((HOST, lan.port), PATIENCE_S) as plain,
        lan.tls().wrap_socket(plain, server_hostname=HOST) as own,
    ):
        assert own.getpeercert(binary_form=True) == shown
        assert own.version() in ("TLSv1.2", "TLSv1.3")
    assert re.search(r"fingerprint must be ([0-9A-F]{2}:){31}[0-9A-F]{2};", words)
    assert f"{lan.origin}/?login=" in link
    assert len(code) == 21  # 41 rows of modules, two in a line


def test_the_link_admits_one_browser_once(lan: Opened) -> None:
    word = lan.word()
    status, cookie = lan.get(word)
    assert status == 200
    assert cookie.startswith(f"{lan.cookie_name}=")
    assert lan.get(word) == (401, "")
    assert lan.get("/", Cookie=cookie) == (200, "")
    assert lan.get("/stage", Cookie=cookie) == (200, "")
    assert lan.get("/stage")[0] == 401
    assert lan.get("/stage", Cookie=cookie, Origin="https://evil.example")[0] == 403
    assert lan.get("/stage", Cookie=cookie, Host="evil.example")[0] == 421
    with lan.dial(lan.origin, Cookie=cookie) as wire:
        assert Visitor(wire).find("GuiButtonMessage", "PANIC")


def test_nobody_else_comes_in(lan: Opened) -> None:
    _, cookie = lan.get(lan.word())
    near = lan.inner
    assert lan.get("/")[0] == 401
    assert lan.get("/?login=guess")[0] == 401
    assert lan.get(f"/?token={near.token}")[0] == 401
    assert lan.get("/", Cookie=f"{lan.cookie_name}={near.token}")[0] == 401
    assert lan.get("/", Cookie=cookie, Host="evil.example")[0] == 421
    assert lan.get("/", Cookie=cookie, Host=f"127.0.0.1:{lan.port}")[0] == 421
    assert lan.get("/", Cookie=cookie, Origin="https://evil.example")[0] == 403
    for status, origin, headers in (
        (401, lan.origin, {}),
        (403, "https://evil.example", {"Cookie": cookie}),
        (403, f"http://{lan.place}", {"Cookie": cookie}),
        (421, None, {"Cookie": cookie, "Host": "evil.example"}),
    ):
        with pytest.raises(InvalidStatus) as refused:
            lan.dial(origin, **headers).close()
        assert refused.value.response.status_code == status


def test_plain_http_gets_no_answer(lan: Opened) -> None:
    with socket.create_connection((HOST, lan.port), timeout=PATIENCE_S) as plain:
        plain.sendall(f"GET / HTTP/1.1\r\nHost: {lan.place}\r\n\r\n".encode())
        heard = b""
        try:
            while piece := plain.recv(1000):
                heard += piece
        except ConnectionResetError:
            pass
    assert not heard.startswith(b"HTTP")


def test_who_came_in_by_a_link_cannot_let_others_in(lan: Opened) -> None:
    _, cookie = lan.get(lan.word())
    with lan.dial(lan.origin, Cookie=cookie) as wire:
        phone = Visitor(wire)
        phone.find("GuiFolderMessage", "Scene")
        link = lan.word()
        phone.updates.clear()
        while len({str(u) for u in phone.updates if "data-beat" in str(u)}) < 3:
            phone.read()  # what was sent to it alone has come by then
        assert labels(phone).isdisjoint({"New login link", "Phone"})
        assert not [u for u in phone.updates if link in str(u)]


def test_connections_that_say_nothing_keep_neither_this_machine_nor_another_one_out(lan: Opened) -> None:
    silent = [
        socket.create_connection((HOST, lan.port), PATIENCE_S, source_address=("127.0.0.9", 0))
        for _ in range(100)
    ]
    try:
        assert lan.get_once("/", "127.0.0.98", {})[0] == 401  # a stranger, at the first try
        near = http.client.HTTPConnection("127.0.0.1", lan.inner.port, timeout=PATIENCE_S)
        near.request("GET", "/", headers={"Cookie": lan.inner.cookie})
        assert near.getresponse().status == 200
        near.close()
    finally:
        for each in silent:
            each.close()


@pytest.mark.needs("chromium")
def test_a_phone_comes_in_by_the_link_and_moves_a_value(lan: Opened, rig: FakeRig, browser: Browser) -> None:
    link = lan.new_link()
    context = visitor(browser, PHONE, home=lan.origin)
    try:
        page = context.new_page()
        page.goto(link)
        expect(readback(page, "dv_pls")).to_have_text("0.2m/s")
        slider(page, "dv_pls").press("ArrowRight")
        wait_until(lambda: rig.sets, "a set query")
        assert rig.sets == [("dv_pls", 0.205)]
        expect(page.get_by_role("button", name="Phone", exact=True)).to_have_count(0)
        page.reload()
        expect(readback(page, "dv_pls")).to_have_text("0.205m/s")
    finally:
        context.close()
    late = visitor(browser, PHONE, home=lan.origin)
    try:
        page = late.new_page()
        answer = page.goto(link)
        assert answer is not None
        assert answer.status == 401
        expect(page.get_by_text("was used already")).to_be_visible()
    finally:
        late.close()


@pytest.mark.needs("chromium")
@pytest.mark.long
def test_the_page_of_this_machine_shows_the_code(lan: Opened, rig: FakeRig, browser: Browser) -> None:
    context = visitor(browser, DESKTOP)
    try:
        page = context.new_page()
        page.goto(lan.inner.address)
        opened(page, "Phone")
        expect(part(page, "phone-help")).to_contain_text(lan.origin)
        page.get_by_role("button", name="New login link").click()
        expect(page.get_by_role("img", name="QR code of the login link")).to_be_visible()
        expect(part(page, "phone-link")).to_contain_text("within 10 min")
    finally:
        context.close()


def own_ends(running: PanelProcess) -> set[str]:
    return {each.partition(":")[0] for each in bound(running.process.pid)}


def test_unless_asked_for_nothing_is_opened(served: PanelProcess, lan: Opened) -> None:
    assert own_ends(served) == {"0100007F"}  # 127.0.0.1, as /proc/net writes it
    assert own_ends(lan.inner) == {"0100007F", "0200007F"}
    with dial_port(served.port, f"http://127.0.0.1:{served.port}", Cookie=served.cookie) as wire:
        here = Visitor(wire)
        here.find("GuiFolderMessage", "Scene")
        here.find("GuiButtonMessage", "Lock to me")
        while len({str(u) for u in here.updates if "data-beat" in str(u)}) < 3:
            here.read()
        assert "Phone" not in labels(here)
