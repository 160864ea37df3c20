"""The panel behind nginx and Caddy, by the files of deploy/proxy: a login, the token as before, and its websocket."""

from __future__ import annotations

import base64
import http.client
import re
import socket
import ssl
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest
import viser
from browser import FLAGS
from cryptography.hazmat.primitives import serialization
from panel_process import PanelProcess, panel
from playwright.sync_api import Browser
from rig_process import PATIENCE_S, free_port, wait_for
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin, Subprotocol

from rig.identity import certificates
from tls_wire import TlsWire

pytestmark = pytest.mark.system
FILES = Path(__file__).parents[2] / "deploy" / "proxy"
NAME, USER, PASSWORD = "panel.example", "technician", "a password of this test"
LOGIN = "Basic " + base64.b64encode(f"{USER}:{PASSWORD}".encode()).decode()


class Site:
    """A panel and a proxy in front of it."""

    def __init__(self, inner: PanelProcess, port: int, authority: Path) -> None:
        self.inner, self.port = inner, port
        self.origin = f"https://{NAME}:{port}"
        self._tls = ssl.create_default_context(cafile=str(authority))

    def get(self, path: str, headers: dict[str, str]) -> tuple[int, str]:
        """Status and cookie."""
        connection = http.client.HTTPSConnection(NAME, self.port, context=self._tls, timeout=PATIENCE_S)
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as plain:
            connection.sock = self._tls.wrap_socket(plain, server_hostname=NAME)
            try:
                connection.request("GET", path, headers={"Connection": "close", **headers})
                answer = connection.getresponse()
                answer.read()
                return answer.status, answer.headers.get("Set-Cookie", "")
            finally:
                connection.close()

    def websocket(self, headers: dict[str, str], origin: str) -> tuple[int, bytes]:
        """Status and first frame; b"" without a websocket."""
        try:
            with TlsWire(
                f"wss://{NAME}:{self.port}/", ssl=self._tls, origin=Origin(origin),
                subprotocols=[Subprotocol(f"viser-v{viser.__version__}")], host="127.0.0.1", server_hostname=NAME,
                additional_headers=headers, open_timeout=PATIENCE_S,
            ) as page:  # fmt: skip
                frame = page.recv(PATIENCE_S)
                assert isinstance(frame, bytes)
                return page.response.status_code, frame
        except InvalidStatus as refused:
            return refused.response.status_code, b""


def _certificate(folder: Path) -> Path:
    authority = certificates.new_authority("proxy", datetime.now(UTC))
    pair = certificates.new_pair(authority, "panel", [NAME], datetime.now(UTC), 1)
    (folder / "panel.pem").write_bytes(pair.certificate_pem)
    (folder / "panel.key").write_bytes(pair.key_pem)
    (folder / "ca.pem").write_bytes(authority.certificate.public_bytes(serialization.Encoding.PEM))
    return folder / "ca.pem"


def _written(folder: Path, name: str, inner: int, outer: int) -> Path:
    """The file as it is shipped, but for places."""
    text = (FILES / name).read_text(encoding="utf-8")
    for said, meant in (
        ("/etc/ssl/drumstick", str(folder)), ("/etc/nginx/drumstick.htpasswd", str(folder / "users")),
        ("/etc/caddy/drumstick.users", str(folder / "users")), ("/run/nginx-drumstick.pid", str(folder / "pid")),
        ("listen 443", f"listen 127.0.0.1:{outer}"), ("127.0.0.1:8080", f"127.0.0.1:{inner}"),
        (f"https://{NAME}", f"https://{NAME}:{outer}"), (f"\n{NAME} {{", f"\n{NAME}:{outer} {{\n\tbind 127.0.0.1"),
    ):  # fmt: skip
        text = text.replace(said, meant)
    path = folder / name
    path.write_text(text)
    return path


def _nginx(folder: Path, inner: int, outer: int) -> list[str]:
    hashed = subprocess.run(
        ["openssl", "passwd", "-apr1", PASSWORD], capture_output=True, text=True, check=True
    )
    (folder / "users").write_text(f"{USER}:{hashed.stdout.strip()}\n")
    config = str(_written(folder, "nginx.conf", inner, outer))
    subprocess.run(["nginx", "-t", "-c", config], check=True, timeout=PATIENCE_S)
    return ["nginx", "-c", config, "-g", "daemon off; user root;"]


def _caddy(folder: Path, inner: int, outer: int) -> list[str]:
    command = ["caddy", "hash-password", "--plaintext", PASSWORD]
    hashed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE_S)
    (folder / "users").write_text(f"{USER} {hashed.stdout.strip()}\n")
    config = ["--config", str(_written(folder, "Caddyfile", inner, outer)), "--adapter", "caddyfile"]
    subprocess.run(["caddy", "validate", *config], check=True, timeout=PATIENCE_S)
    return ["caddy", "run", *config]


@contextmanager
def _behind(program: str, folder: Path) -> Iterator[Site]:
    inner, outer = free_port(), free_port()
    authority = _certificate(folder)
    command = (_nginx if program == "nginx" else _caddy)(folder, inner, outer)
    with panel(f"tcp/127.0.0.1:{free_port()}", inner, folder / "token") as page:
        own = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": str(folder)}
        proxy = subprocess.Popen(command, stdin=subprocess.DEVNULL, env=own)
        try:
            wait_for(program, lambda: _listens(outer))
            yield Site(page, outer, authority)
        finally:
            proxy.terminate()
            proxy.wait(PATIENCE_S)


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="module", params=[
    pytest.param("nginx", marks=pytest.mark.needs("nginx")), pytest.param("caddy", marks=pytest.mark.needs("caddy")),
])  # fmt: skip
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with _behind(request.param, tmp_path_factory.mktemp(request.param)) as made:
        yield made


@pytest.mark.daily("nginx")
def test_nobody_gets_in_without_the_login_whatever_token_he_has(site: Site) -> None:
    for headers in ({}, {"Authorization": "Basic " + base64.b64encode(b"technician:guess").decode()}):
        assert site.get(f"/?token={site.inner.token}", headers)[0] == 401
        assert site.websocket({"Cookie": site.inner.cookie, **headers}, site.origin) == (401, b"")


@pytest.mark.daily("nginx")
def test_the_login_alone_is_not_the_token(site: Site) -> None:
    assert site.get("/", {"Authorization": LOGIN})[0] == 401
    assert site.websocket({"Authorization": LOGIN}, site.origin) == (401, b"")


@pytest.mark.daily("nginx")
def test_both_give_the_page_and_its_websocket(site: Site) -> None:
    status, cookie = site.get(f"/?token={site.inner.token}", {"Authorization": LOGIN})
    assert status == 200
    assert re.search(r"; Secure$", cookie, re.IGNORECASE)
    status, frame = site.websocket({"Authorization": LOGIN, "Cookie": site.inner.cookie}, site.origin)
    assert status == 101
    assert frame


@pytest.mark.daily("nginx")
def test_another_sites_page_stays_out(site: Site) -> None:
    allowed = {"Authorization": LOGIN, "Cookie": site.inner.cookie}
    near = f"http://127.0.0.1:{site.inner.port}"
    for foreign in ("https://elsewhere.example", near, f"{site.origin}.elsewhere.example"):
        assert site.websocket(allowed, foreign) == (403, b"")


@pytest.mark.needs("chromium")
@pytest.mark.parametrize("site", [pytest.param("nginx", marks=pytest.mark.needs("nginx"))], indirect=True)
@pytest.mark.long
def test_a_browser_sees_the_page_and_reaches_the_panel(browser: Browser, site: Site) -> None:
    program = browser.browser_type.launch(
        executable_path="/usr/bin/chromium", headless=True, timeout=1e3 * PATIENCE_S,
        args=[*FLAGS, "--no-sandbox", f"--host-resolver-rules=MAP {NAME} 127.0.0.1"],
    )  # fmt: skip
    try:
        context = program.new_context(
            ignore_https_errors=True, http_credentials={"username": USER, "password": PASSWORD}
        )
        context.set_default_timeout(1e3 * PATIENCE_S)
        page = context.new_page()
        page.goto(f"{site.origin}/?token={site.inner.token}")
        page.get_by_text("PANIC").first.wait_for()
    finally:
        program.close()
