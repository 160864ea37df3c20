"""Optional parts of a gateway: OSCQuery, MIDI. Without them nothing of theirs is imported or opened."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.osc.inbound import Network
from haptic_server.gateway.osc.targets import Endpoint
from haptic_server.gateway.played_strikes import Player
from haptic_server.gateway.settings import Parameters
from realtime.service_options import command

if TYPE_CHECKING:
    from haptic_server.gateway.midi.receiver import Ask, AskProgram
    from haptic_server.gateway.oscquery.osc_bridge import OscBridge


class MissingDependency(OSError):
    """A package is not installed, or a port is taken: what, and what to do."""


class Extras:
    """Optional parts of one gateway. The constructor and `open` raise MissingDependency. Main thread."""

    def __init__(self, given: GatewayOptions) -> None:
        self._given = given
        self._bridge = self._query = self._announcement = self.midi = self._midi_in = None
        if given.oscquery is not None:
            try:
                from haptic_server.gateway.oscquery import osc_bridge, server
            except ImportError as error:
                raise _lacking("--oscquery", error) from None
            self._server = server
            self._bridge = osc_bridge.OscBridge(given.osc_in[0])

    @property
    def targets(self) -> list[Endpoint]:
        """Targets of OSC besides those that were given."""
        return [] if self._bridge is None else [self._bridge.endpoint]

    def open(
        self, parameters: Parameters, front: Endpoint, allow: Sequence[Network], insiders: set[Endpoint]
    ) -> None:
        """Serve what was asked for; `front` is where OSC is heard, `allow` are the sources that may use it.

        `insiders` are senders that the OSC server hears besides: whoever they speak for was admitted already.
        """
        if self._bridge is not None and self._given.oscquery is not None:
            self._open_query(self._bridge, self._given.oscquery, parameters, front, allow, insiders)
        if self._given.midi_out is not None:
            self._open_midi(self._given.midi_out)

    def play_scene(self, parameters: Parameters) -> None:
        """Describe the addresses of another scene from now on."""
        if self._query is not None:
            self._query.play_scene(parameters)

    def _open_query(
        self,
        bridge: OscBridge,
        bind: Endpoint,
        parameters: Parameters,
        front: Endpoint,
        allow: Sequence[Network],
        insiders: set[Endpoint],
    ) -> None:
        given = self._given
        try:
            self._query = self._server.OscQuery(
                bind, given.rig, given.prefix, parameters, front, bridge, allow, insiders
            )
        except OSError as error:
            host, port = bind
            raise MissingDependency(
                f"OSCQuery port {host}:{port} cannot be opened: {error.strerror}; choose another with --oscquery"
            ) from None
        if given.oscquery_announce or not self._query.is_on_loopback:
            from haptic_server.gateway.oscquery.mdns import Announcement

            try:
                self._announcement = Announcement(given.rig, self._query.endpoint, front)
            except ImportError as error:
                raise _lacking("announcing OSCQuery", error) from None

    def _open_midi(self, name: str) -> None:
        from haptic_server.gateway.midi.encoding import Voice
        from haptic_server.gateway.midi.options import MidiOptions
        from haptic_server.gateway.midi.port_process import PortProcess
        from haptic_server.gateway.midi.sender import MidiSender

        given = self._given
        options = MidiOptions(client=f"drumstick {given.rig}", port=name)
        port = PortProcess(command("haptic_server.gateway.midi", options))
        self.midi = MidiSender(Voice(given.midi_note, given.midi_channel), port)

    def listen_to_midi(self, player: Player, ask: Ask, ask_program: AskProgram) -> None:
        """Play the notes of the port that was asked for, if one was, and follow its controllers and programs."""
        given = self._given
        if given.midi_in is None:
            return
        if self._midi_in is not None:
            self._midi_in.play_scene(player, ask, ask_program)
            return
        from haptic_server.gateway.midi.note_map import DEFAULT_PLACES, NoteMap
        from haptic_server.gateway.midi.options import MidiOptions
        from haptic_server.gateway.midi.port_process import PortProcess
        from haptic_server.gateway.midi.receiver import MidiReceiver

        places = dict(given.midi_in_notes) or DEFAULT_PLACES
        self._midi_in = MidiReceiver(
            NoteMap(given.midi_in_channel, given.midi_in_curve, places), player, ask, ask_program
        )
        options = MidiOptions(client=f"drumstick {given.rig} in", port=given.midi_in, listens=True)
        self._midi_in.listen(PortProcess(command("haptic_server.gateway.midi", options), self._midi_in.take))

    def counters(self) -> dict[str, dict[str, int]]:
        """Counts for `doctor`."""
        parts = {"oscquery": self._query, "midi": self.midi, "midi_in": self._midi_in}
        return {name: each.counters for name, each in parts.items() if each is not None}

    def close(self) -> None:
        """End all of it. Idempotent."""
        for each in (self._midi_in, self.midi, self._announcement, self._query, self._bridge):
            if each is not None:
                each.close()


def _lacking(what: str, error: ImportError) -> MissingDependency:
    return MissingDependency(f"{what}: {error}; install haptic-drumstick[oscquery]")
