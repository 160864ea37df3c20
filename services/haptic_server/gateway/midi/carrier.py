"""Holds one MIDI port through the library: finds it by a part of its name, notices when it goes, takes it again.

For the process that has the library (`python -m haptic_server.gateway.midi`); one thread.
"""

from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, Protocol, TypeVar

from haptic_server.gateway.midi.encoding import ALL_NOTES_OFF, CONTROL, NOTE_OFF, NOTE_ON, RELEASE_VELOCITY

VIRTUAL = "virtual"


class Port(Protocol):
    """The part of rtmidi2's clients used here: of one MIDI system, with at most one port open."""

    @property
    def ports(self) -> Sequence[str]:
        """Names of the ports that can be opened now."""
        ...

    def open_port(self, port: int, /) -> object:
        """Open the port of this number in `ports`."""
        ...

    def open_virtual_port(self, port_name: str, /) -> object:
        """Make a port that others can connect to."""
        ...

    def close_port(self) -> object:
        """Let go of it."""
        ...


class Output(Port, Protocol):
    """A client that sends."""

    def send_raw(self, *message: int) -> object:
        """One message."""
        ...


_P = TypeVar("_P", bound=Port)


class Report(NamedTuple):
    """State of the port (open or not), and words for the log."""

    open: bool
    words: str


class Connection(Generic[_P]):
    """Connection to the port whose name contains `wanted` (in any case), or to a virtual port named `client`.

    `clients` makes a new client of each MIDI system that runs now; `does` says in the log what is done with the port.
    """

    def __init__(self, wanted: str, client: str, clients: Callable[[], Sequence[_P]], does: str) -> None:
        self._wanted = wanted
        self._client = client
        self._clients = clients
        self._does = does
        self._port: _P | None = None
        self._name = ""

    def poll(self) -> Report | None:
        """Open the port if it is there, notice if it has gone; None when nothing has changed."""
        try:
            if self._port is None:
                return self._open()
            if self._wanted != VIRTUAL and self._name not in self._port.ports:
                return self._gone(f"{self._name} is away; waiting for it")
        except (RuntimeError, OSError) as error:  # what the library's drivers raise
            return self._gone(f"{self._name or self._wanted}: {error}; trying again")
        return None

    def close(self) -> None:
        """Let go of the port, and of what has not left it yet."""
        self._gone("")

    def _open(self) -> Report:
        clients = self._clients()
        if not clients:
            return Report(False, "no MIDI system runs here (ALSA's sequencer, JACK); waiting for one")
        if self._wanted == VIRTUAL:
            clients[0].open_virtual_port(self._client)
            return self._opened(clients[0], self._client)
        there: list[str] = []
        for client in clients:
            names = list(client.ports)
            there += names
            for number, name in enumerate(names):
                if self._wanted.casefold() in name.casefold():
                    client.open_port(number)
                    return self._opened(client, name)
        listed = ", ".join(there) or "none"
        return Report(
            False, f"no port has {self._wanted!r} in its name (there are: {listed}); waiting for it"
        )

    def _opened(self, port: _P, name: str) -> Report:
        self._port, self._name = port, name
        return Report(True, f"{self._does} {name}")

    def _gone(self, words: str) -> Report:
        if self._port is not None:
            self._port.close_port()
        self._port = None
        return Report(False, words)


class Carrier(Connection[Output]):
    """Connection that sends, and ends the notes that it has begun."""

    def __init__(self, wanted: str, client: str, clients: Callable[[], Sequence[Output]]) -> None:
        super().__init__(wanted, client, clients, "strikes go to")
        self._sounding: set[tuple[int, int]] = set()
        self._channels: set[int] = set()

    def send(self, message: bytes) -> Report | None:
        """One message of three bytes; a report when the port has gone."""
        if self._port is None:
            return None
        kind, channel = message[0] & 0xF0, message[0] & 0x0F
        self._channels.add(channel)
        if kind == NOTE_ON and message[2]:
            self._sounding.add((channel, message[1]))
        elif kind in (NOTE_ON, NOTE_OFF):
            self._sounding.discard((channel, message[1]))
        try:
            self._port.send_raw(*message)
        except (RuntimeError, OSError) as error:
            return self._gone(f"{self._name}: {error}; trying again")
        return None

    def silence(self) -> None:
        """End every note that was begun."""
        for channel, note in sorted(self._sounding):
            self.send(bytes((NOTE_OFF | channel, note, RELEASE_VELOCITY)))
        for channel in sorted(self._channels):
            self.send(bytes((CONTROL | channel, ALL_NOTES_OFF, 0)))

    def _gone(self, words: str) -> Report:
        self._sounding.clear()
        self._channels.clear()
        return super()._gone(words)
