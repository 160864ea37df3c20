"""rtmidi2 as a Library: a client of each MIDI system that runs. Only for the process that has the library."""

import os
import sys
from collections.abc import Callable
from typing import Any

from haptic_server.gateway.midi.carrier import Output, Port
from haptic_server.gateway.midi.jack import Jack

_SEQUENCER = "/dev/snd/seq"


def _hear_nothing(_message: list[int], _delta_s: float) -> None:
    """Hear nothing: the client only lists its ports."""


class RtMidi:
    """The constructor raises ImportError when rtmidi2 is not installed."""

    def __init__(self, client: str) -> None:
        self._client = client
        self.jack: Jack | None = None
        if sys.platform == "linux":
            try:
                self.jack = Jack()
            except OSError:  # no JACK on this machine
                self.jack = None
        import rtmidi2  # after JACK, see there

        self._rtmidi: Any = rtmidi2

    def outputs(self) -> list[Output]:
        """ALSA before JACK on Linux; CoreMIDI, Windows MM."""
        return [self._rtmidi.MidiOut(self._client, api=api) for api in self._systems()]

    def inputs(self, hear: Callable[[list[int], float], None]) -> list[Port]:
        """Clients of the same systems that listen; `hear` gets each message, on a thread of the library."""
        found: list[Port] = []
        for system in self._systems():
            client = self._rtmidi.MidiIn(self._client, api=system)
            client.callback = hear
            found.append(client)
        return found

    def names(self, listens: bool = False) -> list[str]:
        """List every port that can be opened now: to be heard, or to be played."""
        clients = self.inputs(_hear_nothing) if listens else self.outputs()
        return [name for client in clients for name in client.ports]

    def _systems(self) -> list[int]:
        # Asked beforehand: a client of a system that does not run prints lines, or ends the process.
        if sys.platform == "darwin":
            return [self._rtmidi.API_MACOSX_CORE]
        if sys.platform == "win32":
            return [self._rtmidi.API_WINDOWS_MM]
        found: list[int] = []
        if os.access(_SEQUENCER, os.R_OK | os.W_OK):
            found.append(self._rtmidi.API_LINUX_ALSA)
        if self.jack is not None and self.jack.runs(self._client):
            found.append(self._rtmidi.API_UNIX_JACK)
        return found
