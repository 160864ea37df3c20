"""The page as it is opened to the network: dialled over TLS, from any address of loopback, and its login links."""

import http.client
import re
import socket
import ssl
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import viser
from panel_process import PanelProcess, panel
from panel_wire import Visitor, dial_port
from rig_process import PATIENCE_S
from websockets.exceptions import InvalidMessage
from websockets.typing import Origin, Subprotocol

from ports import free_port
from rig.identity.page_certificate import page_certificate
from tls_wire import TlsWire
from web_panel.options import LanOptions

HOST = "127.0.0.2"  # stands for the network's: the panel knows only the address that it was given
_Answer = TypeVar("_Answer")


def when_there_is_a_place(call: Callable[[], _Answer]) -> _Answer:
    """Call until it is not turned away: one address has so many places, and who leaves holds his a moment longer."""
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            return call()
        except ssl.SSLCertVerificationError:
            raise
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
class LanPage:
    """The page at HOST. `near_port` and `near_cookie`: of the same panel's page of this machine."""

    port: int
    certificate: Path
    near_port: int
    near_cookie: str

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

    def tcp(self, source: str = "127.0.0.1") -> socket.socket:
        """A connection before its handshake; `source` is this end's address."""
        return socket.create_connection((HOST, self.port), PATIENCE_S, source_address=(source, 0))

    def shaken(self, source: str = "127.0.0.1") -> ssl.SSLSocket:
        """A connection after its handshake, before any request."""
        plain = self.tcp(source)
        try:
            return self.tls().wrap_socket(plain, server_hostname=HOST)
        except BaseException:
            plain.close()
            raise

    def websocket(self, cookie: str, source: str) -> ssl.SSLSocket:
        """A websocket by whose wire anything may be sent."""
        lines = (
            "GET / HTTP/1.1", f"Host: {self.place}", f"Origin: {self.origin}", f"Cookie: {cookie}",
            "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", "",
        )  # fmt: skip
        connection = self.shaken(source)
        connection.sendall("\r\n".join(lines).encode())
        assert b" 101 " in connection.recv(4096)
        return connection

    def get(self, path: str, source: str = "127.0.0.1", **headers: str) -> tuple[int, str]:
        """Status and cookie."""
        return when_there_is_a_place(lambda: self.get_once(path, source, headers))

    def get_once(self, path: str, source: str, headers: dict[str, str]) -> tuple[int, str]:
        """The same, but it raises OSError or InvalidMessage where there is no place."""
        connection = http.client.HTTPSConnection(
            HOST, self.port, context=self.tls(), timeout=PATIENCE_S, source_address=(source, 0)
        )
        try:
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            answer.read()
            return answer.status, (answer.headers["Set-Cookie"] or "").partition(";")[0]
        finally:
            connection.close()

    def dial(self, origin: str | None = None, source: str = "127.0.0.1", **headers: str) -> TlsWire:
        """Its websocket; raises what `websockets` raises."""
        return when_there_is_a_place(lambda: self.dial_once(origin, source, headers))

    def dial_once(self, origin: str | None, source: str, headers: dict[str, str]) -> TlsWire:
        """The same, but it raises OSError or InvalidMessage where there is no place."""
        return TlsWire(
            f"wss://{self.place}/",
            ssl=self.tls(),
            origin=None if origin is None else Origin(origin),
            additional_headers=headers,
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            open_timeout=PATIENCE_S,
            max_size=None,
            local_addr=(source, 0),
        )

    def new_link(self) -> str:
        """The link that is shown at the haptic machine when one asks for another."""
        near = f"http://127.0.0.1:{self.near_port}"
        with dial_port(self.near_port, near, Cookie=self.near_cookie) as wire:
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


@dataclass
class Opened(LanPage):
    """A panel that is open to the network, and what it said."""

    inner: PanelProcess
    said: list[str]


@contextmanager
def opened_panel(endpoint: str, folder: Path) -> Generator[Opened]:
    """A panel of this rig, open to the network; it keeps its files in `folder`."""
    port = free_port()
    certificate, key = page_certificate(folder, HOST)
    at = LanOptions(host=HOST, port=port, certificate=certificate, private_key=key, in_terminal=True)
    with panel(endpoint, free_port(), folder / "token", lan=at) as running:
        said = [running.lines.get(timeout=PATIENCE_S) for _ in range(2)]
        while "\x1b" in (line := running.lines.get(timeout=PATIENCE_S)):
            said.append(line)
            if len(said) == 2 + 21:
                break
        yield Opened(port, certificate, running.port, running.cookie, running, said)
