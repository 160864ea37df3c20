"""Admission from the network (--panel-lan). Like that of this machine, but by a one-time link at first, and by a signed
cookie that ends after 12 hours.

The token of this machine's page admits nobody here, and what admits here admits nobody there.
"""

import hmac
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from web_panel.access.admission import Admission, Headers, is_same
from web_panel.access.one_time_login import OneTimeLogin

LIFE_H = 12


@dataclass(frozen=True, kw_only=True)
class LanAdmission(Admission):
    """The rules at one address of this machine. `clock`: the day's, in seconds, since a cookie outlives the panel."""

    host: str
    login: OneTimeLogin
    clock: Callable[[], float] = time.time

    scheme: ClassVar[str] = "https"
    word: ClassVar[str] = "login"
    refusal: ClassVar[str] = (
        "This login link was used already, or is too old: ask for a new one (Phone, on the page at the haptic machine)."
    )

    @property
    def place(self) -> str:
        """Host and port as browsers write them."""
        return self.host if self.port == 443 else f"{self.host}:{self.port}"

    @property
    def address(self) -> str:
        """Address of the page from the network."""
        return f"https://{self.place}/"

    @property
    def open_link(self) -> str:
        """The link that still admits a browser; "" when there is none."""
        secret = self.login.open_secret
        return f"{self.address}?{self.word}={secret}" if secret else ""

    @property
    def cookie(self) -> str:
        """The Set-Cookie header's value, for a browser that comes in now."""
        until = str(int(self.clock()) + LIFE_H * 3600)
        value = f"{until}.{self._signature(until)}"
        return self.cookie_line(value, LIFE_H * 3600) + "; Secure"

    @property
    def host_words(self) -> str:
        """Words for a visitor of another name."""
        return f"This panel answers only to {self.place}."

    def is_own(self, host: str) -> bool:
        """True for the one address at which it is opened."""
        return host == self.place

    def admits_word(self, given: str) -> bool:
        """True once for each link."""
        return self.login.take(given)

    def admits_cookie(self, value: str) -> bool:
        """True for a cookie that was signed here and has not ended."""
        return self.clock() < self._end_of(value)

    def end_of(self, headers: Headers) -> float:
        """Time of day in s at which a websocket that came with these headers is closed: when its cookie ends.

        One without a cookie was let in by its link.
        """
        cookies = self._cookies(headers)
        return max(map(self._end_of, cookies)) if cookies else self.clock() + LIFE_H * 3600

    def _end_of(self, value: str) -> float:
        until, _, signature = value.partition(".")
        return float(int(until)) if is_same(signature, self._signature(until)) else 0.0

    def _signature(self, until: str) -> str:
        signed = f"lan {self.place} {until}".encode(errors="backslashreplace")
        return hmac.digest(self.token.encode(), signed, "sha256").hex()
