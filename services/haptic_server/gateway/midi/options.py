"""Options of the process that has the MIDI library. Any thread."""

from realtime.service_options import ServiceOptions


class MidiOptions(ServiceOptions, frozen=True, kw_only=True):
    """client: our name at the MIDI systems; port: part of a port's name, or virtual; None: list them all.

    listens: hear the port, and do not play it.
    """

    client: str
    port: str | None = None
    listens: bool = False
