"""The secret of a login link: it admits one browser, once, within ten minutes. Any thread."""

import secrets
import threading
import time
from collections.abc import Callable

from web_panel.access.admission import is_same

LIFE_S = 600.0
_BYTES = 16  # 128 bits: enough for ten minutes, and the picture of the link stays small


class OneTimeLogin:
    """One secret at a time: a new one ends the one before. `clock` counts seconds and never goes back."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._secret, self._until_s = "", 0.0

    def renew(self) -> str:
        """Make a new secret."""
        with self._lock:
            self._secret, self._until_s = secrets.token_urlsafe(_BYTES), self._clock() + LIFE_S
            return self._secret

    @property
    def open_secret(self) -> str:
        """The secret that still admits; "" when it was used or is too old."""
        with self._lock:
            return self._secret if self._clock() < self._until_s else ""

    @property
    def left_s(self) -> float:
        """Seconds for which it still admits; 0 when it does no more."""
        with self._lock:
            return max(self._until_s - self._clock(), 0.0) if self._secret else 0.0

    def take(self, given: str) -> bool:
        """True when `given` is the secret; from then on it is none any more."""
        with self._lock:
            if not self._secret or self._clock() >= self._until_s or not is_same(given, self._secret):
                return False
            self._secret = ""
            return True
