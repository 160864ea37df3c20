"""The JACK of this machine, for rtmidi2, and word of its end. Linux; belongs to the process that has the library.

rtmidi2's wheel brings a JACK library of its own, which speaks to no other version's server. When the system's is in the
process first, with its names for all to see, rtmidi2 uses that.
"""

import ctypes
import threading

_NO_START_SERVER = 1
_ENDED = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class Jack:
    """The constructor raises OSError when this machine has no JACK library. Make it before rtmidi2 is imported."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL("libjack.so.0", mode=ctypes.RTLD_GLOBAL)
        self._library.jack_client_open.restype = ctypes.c_void_p
        self._library.jack_client_open.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
        self._library.jack_on_shutdown.argtypes = [ctypes.c_void_p, _ENDED, ctypes.c_void_p]
        self._library.jack_activate.argtypes = [ctypes.c_void_p]
        self.ended = threading.Event()
        self._on_end = _ENDED(self._has_ended)
        self._client: int | None = None

    def _has_ended(self, _: int | None) -> None:
        self.ended.set()

    def runs(self, client: str) -> bool:
        """Look for a JACK server; True when there is one.

        From then on `ended` reports its end, by a client without ports.
        """
        if self._client is None:
            name = f"{client} watch".encode()
            self._client = self._library.jack_client_open(name, _NO_START_SERVER, None)
            if self._client is not None:
                self._library.jack_on_shutdown(self._client, self._on_end, None)
                self._library.jack_activate(self._client)
        return self._client is not None and not self.ended.is_set()
