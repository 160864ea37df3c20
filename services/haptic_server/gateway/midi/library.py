"""rtmidi2 as a Library: a client of each MIDI system that runs. Only for the process that has the library."""

import os
import sys
from typing import Any

from haptic_server.gateway.midi.carrier import Output
from haptic_server.gateway.midi.jack import Jack

_SEQUENCER = "/dev/snd/seq"


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

    def names(self) -> list[str]:
        """List every port that can be opened now."""
        return [name for output in self.outputs() for name in output.ports]

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
