"""The page from the network (--panel-lan): a phone comes in by the one-time link over TLS, and nobody else comes in.

Another address of loopback stands for the network's: the panel knows only the address that it was given.
"""

import http.client
import re
import socket
import ssl
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import pytest
import viser
from browser import DESKTOP, PATIENCE_MS, PHONE, opened, part, readback, slider, visitor
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess, panel
from panel_wire import Visitor, dial_port
from playwright.sync_api import Browser, expect
from rig_process import bound
from tls_wire import TlsWire
from websockets.exceptions import InvalidMessage, InvalidStatus
from websockets.typing import Origin, Subprotocol

from ports import free_port
from rig.identity.page_certificate import page_certificate
from web_panel.options import LanOptions

pytestmark = pytest.mark.system
HOST = "127.0.0.2"


_Answer = TypeVar("_Answer")


def _when_there_is_a_place(call: Callable[[], _Answer]) -> _Answer:
    # One address has so many places and no more; who was refused leaves his a moment after the answer.
    until = time.monotonic() + 60.0
    while True:
        try:
            return call()
        except (InvalidMessage, OSError):  # closed before an answer; errors of TLS are OSErrors
            if time.monotonic() > until:
                raise
            time.sleep(0.1)


class AtTheMachine(Visitor):
    """A browser of the haptic machine, which shows login links."""

    def contents(self) -> str:
        made = [each.get("props", {}) for each in self.parts.values()]
        written = [each["updates"] for each in self.updates]
        return "\n".join(str(each.get("content", "")) for each in made + written)

    def links(self) -> set[str]:
        return set(re.findall(r"https://\S+\?login=[\w-]+", self.contents()))


@dataclass
class Opened:
    """A panel that is open to the network, and what it said."""

    inner: PanelProcess
    port: int
    certificate: Path
    said: list[str]

    @property
    def place(self) -> str:
        return f"{HOST}:{self.port}"

    @property
    def origin(self) -> str:
        return f"https://{self.place}"

    @property
    def cookie_name(self) -> str:
        return f"drumstick_panel_{self.port}"

    def tls(self) -> ssl.SSLContext:
        """As somebody who compared the fingerprint: this certificate, and none else."""
        context = ssl.create_default_context(cafile=str(self.certificate))
        context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
        return context

    def get(self, path: str, **headers: str) -> tuple[int, str]:
        """Status and cookie."""
        return _when_there_is_a_place(lambda: self._get(path, headers))

    def _get(self, path: str, headers: dict[str, str]) -> tuple[int, str]:
        connection = http.client.HTTPSConnection(HOST, self.port, context=self.tls(), timeout=20)
        try:
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            answer.read()
            return answer.status, (answer.headers["Set-Cookie"] or "").partition(";")[0]
        finally:
            connection.close()

    def dial(self, origin: str | None = None, **headers: str) -> TlsWire:
        return _when_there_is_a_place(lambda: self._dial(origin, headers))

    def _dial(self, origin: str | None, headers: dict[str, str]) -> TlsWire:
        return TlsWire(
            f"wss://{self.place}/",
            ssl=self.tls(),
            origin=None if origin is None else Origin(origin),
            additional_headers=headers,
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            open_timeout=20,
            max_size=None,
        )

    def new_link(self) -> str:
        """The link that is shown at the haptic machine when one asks for another."""
        near = f"http://127.0.0.1:{self.inner.port}"
        with dial_port(self.inner.port, near, Cookie=self.inner.cookie) as wire:
            here = AtTheMachine(wire)
            button = here.find("GuiButtonMessage", "New login link")
            while "phone-link" not in here.contents():
                here.read()
            before = here.links()  # the one that is shown is written again when a minute is over
            here.update(button, value=True)
            while not (new := here.links() - before):
                here.read()
            return new.pop()

    def word(self) -> str:
        """The path of a new link."""
        return self.new_link().removeprefix(self.origin)


@pytest.fixture(scope="module")
def lan(faked: FakeRig, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    folder = tmp_path_factory.mktemp("lan")
    port = free_port()
    certificate, key = page_certificate(folder, HOST)
    at = LanOptions(host=HOST, port=port, certificate=certificate, private_key=key, in_terminal=True)
    with panel(faked.endpoint, free_port(), folder / "token", lan=at) as running:
        said = [running.lines.get(timeout=20) for _ in range(2)]
        while "\x1b" in (line := running.lines.get(timeout=20)):
            said.append(line)
            if len(said) == 2 + 21:
                break
        yield Opened(running, port, certificate, said)


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
        socket.create_connection((HOST, lan.port), 20) as plain,
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
    with socket.create_connection((HOST, lan.port), timeout=20) as plain:
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
        socket.create_connection((HOST, lan.port), 20, source_address=("127.0.0.9", 0)) for _ in range(100)
    ]
    try:
        assert lan.get("/")[0] == 401
        near = http.client.HTTPConnection("127.0.0.1", lan.inner.port, timeout=20)
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
        page.set_default_timeout(PATIENCE_MS)
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
        page.set_default_timeout(PATIENCE_MS)
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
