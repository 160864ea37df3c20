"""Options of the gateway's process. Any thread."""

from ipaddress import ip_network
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from haptic_server.gateway.midi.encoding import CHANNELS, DEFAULT_CHANNEL, DEFAULT_NOTE, NOTES
from haptic_server.gateway.midi.note_map import CURVES, LISTENS_TO
from protocol.access.identity import Identity
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig
from protocol.osc import DEFAULT_IN, DEFAULT_OUT, DEFAULT_PREFIX
from realtime.service_options import ServiceOptions

Address = tuple[str, Annotated[int, Meta(ge=0, le=65535)]]


class GatewayOptions(ServiceOptions, frozen=True, kw_only=True):
    """run_dir holds scene.toml and the servo's block, state_dir the presets.

    listen: be the Zenoh router at this endpoint; connect: be a client of this one instead, as `identity`. osc_allow:
    networks that may send OSC, empty: loopback. fresh: start from the scene, not from the last good set. supervised:
    whoever starts this changes scenes when asked. midi_in_notes: x of notes; empty: General MIDI's.
    """

    run_dir: Path
    state_dir: Path
    rig: str = DEFAULT_RIG
    listen: str = DEFAULT_ROUTER
    connect: str | None = None
    identity: Identity | None = None
    osc_in: Address = DEFAULT_IN
    osc_out: tuple[Address, ...] = (DEFAULT_OUT,)
    osc_allow: tuple[str, ...] = ()
    prefix: str = DEFAULT_PREFIX
    fresh: bool = False
    supervised: bool = False
    oscquery: Address | None = None
    oscquery_announce: bool = False
    midi_out: str | None = None
    midi_note: Annotated[int, Meta(ge=NOTES[0], le=NOTES[1])] = DEFAULT_NOTE
    midi_channel: Annotated[int, Meta(ge=CHANNELS[0], le=CHANNELS[1])] = DEFAULT_CHANNEL
    midi_in: str | None = None
    midi_in_notes: tuple[tuple[int, float], ...] = ()
    midi_in_curve: Annotated[float, Meta(ge=CURVES[0], le=CURVES[1])] = 1.0
    midi_in_channel: Annotated[int, Meta(ge=LISTENS_TO[0], le=LISTENS_TO[1])] = 0

    def __post_init__(self) -> None:
        checked_rig(self.rig)
        for network in self.osc_allow:
            ip_network(network)
