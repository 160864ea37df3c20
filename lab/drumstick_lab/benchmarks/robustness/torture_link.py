"""A cable between a far sound server and its router, as a TCP port of this process that can be cut and held."""

import contextlib
import select
import socket
import threading

_CHUNK = 65536


class Link:
    """Carries bytes from its own port to another on this machine. Its thread lives until `close`."""

    def __init__(self, to_port: int) -> None:
        self._to = ("127.0.0.1", to_port)
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._door.getsockname()[1]
        self._peer: dict[socket.socket, socket.socket] = {}
        self._is_cut, self._is_held, self._over = threading.Event(), threading.Event(), threading.Event()
        self.is_still = False  # held, and its thread has seen that
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def cut(self) -> None:
        """Both ends are told that it is gone, and nobody gets in."""
        self._is_cut.set()

    def hold(self) -> None:
        """Let nothing pass, without telling anybody."""
        self._is_held.set()

    def mend(self) -> None:
        """Carry again as new."""
        self._is_cut.clear()
        self._is_held.clear()

    def close(self) -> None:
        """Let go of all."""
        self._over.set()
        self._thread.join()
        self._drop_all()
        self._door.close()

    def _drop_all(self) -> None:
        for one in list(self._peer):
            one.close()
        self._peer.clear()

    def _admit(self) -> None:
        near, _ = self._door.accept()
        if self._is_cut.is_set():
            near.close()
            return
        try:
            far = socket.create_connection(self._to, timeout=1.0)
        except OSError:
            near.close()
            return
        for one, other in ((near, far), (far, near)):
            one.settimeout(1.0)
            self._peer[one] = other

    def _pass(self, one: socket.socket) -> None:
        other = self._peer.get(one)
        if other is None:  # dropped with its peer just now
            return
        with contextlib.suppress(OSError):
            chunk = one.recv(_CHUNK)
            if chunk:
                other.sendall(chunk)
                return
        for gone in (one, other):
            self._peer.pop(gone, None)
            gone.close()

    def _carry(self) -> None:
        while not self._over.is_set():
            if self._is_cut.is_set():
                self._drop_all()
            self.is_still = self._is_held.is_set()
            watched = [self._door] if self.is_still else [self._door, *self._peer]
            ready, _, _ = select.select(watched, [], [], 0.05)
            for one in ready:
                if one is self._door:
                    self._admit()
                else:
                    self._pass(one)
