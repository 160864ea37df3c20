"""Admission to the page. Pure: headers and path in, a verdict out. Any thread.

Three checks, in this order: the Host must be this machine's own name (a foreign name that resolves to 127.0.0.1 is
DNS rebinding), the Origin, when a browser sends one, must be the page itself, and the visitor must know the token, from
the address at first and from a cookie later. The rules for other machines: `web_panel.access.lan_admission`.
"""

import hmac
import re
from dataclasses import dataclass
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import ClassVar, Protocol
from urllib.parse import parse_qs, urlsplit

# Any port: a technician may come through a tunnel whose local port differs.
_OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:[0-9]{1,5})?", re.IGNORECASE)
_COOKIE_LIFE_S = 30 * 24 * 3600


class Headers(Protocol):
    """The part of a request's headers used here."""

    def get_all(self, key: str, /) -> list[str]:
        """Every value sent under this name, in any case of letters."""
        ...


@dataclass(frozen=True)
class Verdict:
    """OK, or why not; `by_address` when the token stood in the address, so that a cookie should be set."""

    status: HTTPStatus
    words: str = ""
    host: str = ""
    by_address: bool = False


def is_same(given: str, secret: str) -> bool:
    """True when a visitor knows the secret; how long it takes tells nothing of it."""
    # Bytes that are no text come as lone surrogates, which no encoding takes as they are.
    return hmac.compare_digest(given.encode(errors="backslashreplace"), secret.encode())


@dataclass(frozen=True)
class Admission:
    """The rules of one panel. The cookie carries the port in its name: cookies do not keep ports apart."""

    token: str
    port: int

    scheme: ClassVar[str] = "http"
    word: ClassVar[str] = "token"  # what the address holds the secret as
    refusal: ClassVar[str] = (
        "Open the whole address that the panel printed when it started, with ?token=... at its end."
    )

    @property
    def cookie_name(self) -> str:
        """Name of the cookie that stands for the token."""
        return f"drumstick_panel_{self.port}"

    @property
    def cookie(self) -> str:
        """The Set-Cookie header's value."""
        return self.cookie_line(self.token, _COOKIE_LIFE_S)

    def cookie_line(self, value: str, life_s: int) -> str:
        """A Set-Cookie header that scripts and other sites do not get to see."""
        return f"{self.cookie_name}={value}; Path=/; Max-Age={life_s}; HttpOnly; SameSite=Strict"

    @property
    def host_words(self) -> str:
        """Words for a visitor who calls this machine by another name."""
        return "This panel answers only to 127.0.0.1 and localhost."

    def is_own(self, host: str) -> bool:
        """True when a Host header names this page."""
        return _OWN_HOST.fullmatch(host) is not None

    def admits_word(self, given: str) -> bool:
        """True when the address holds the secret."""
        return is_same(given, self.token)

    def admits_cookie(self, value: str) -> bool:
        """True when a cookie stands for the secret."""
        return is_same(value, self.token)

    def judge(self, headers: Headers, path: str) -> Verdict:
        """The verdict on a request for a page or for a websocket; `path` with its query."""
        hosts = headers.get_all("Host")
        if len(hosts) != 1 or not self.is_own(hosts[0]):
            return Verdict(HTTPStatus.MISDIRECTED_REQUEST, self.host_words)
        host = hosts[0]
        if any(origin.lower() != f"{self.scheme}://{host.lower()}" for origin in headers.get_all("Origin")):
            return Verdict(HTTPStatus.FORBIDDEN, "Another site's page may not use this panel.")
        if any(self.admits_word(given) for given in _words_in(path, self.word)):
            return Verdict(HTTPStatus.OK, host=host, by_address=True)
        if any(self.admits_cookie(value) for value in self._cookies(headers)):
            return Verdict(HTTPStatus.OK, host=host)
        return Verdict(HTTPStatus.UNAUTHORIZED, self.refusal)

    def _cookies(self, headers: Headers) -> list[str]:
        found: list[str] = []
        for line in headers.get_all("Cookie"):
            try:
                morsel = SimpleCookie(line).get(self.cookie_name)
            except CookieError:
                continue  # a cookie that cannot be read admits nobody
            if morsel is not None:
                found.append(morsel.value)
        return found


def _words_in(path: str, name: str) -> list[str]:
    try:
        return parse_qs(urlsplit(path).query, max_num_fields=16).get(name, [])
    except ValueError:
        return []
