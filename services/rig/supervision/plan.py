"""Processes of a rig, and the command line of each. Of a service only its options are imported."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

from haptic_server.access.options import AccessOptions
from haptic_server.gateway.midi.note_map import places_of
from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.options import ServoOptions
from protocol.access.identity import Identity
from protocol.keys import DEFAULT_ROUTER
from protocol.osc import DEFAULT_IN
from protocol.session import Public
from realtime.service_options import ServiceOptions, command
from rig.accuracy_files import FILE, SHIPPED
from rig.checks import DEFAULT_TARGET
from rig.exit_status import usage_error
from rig.folder import accuracy_folder
from rig.identity.page_certificate import page_certificate
from rig.network.osc_targets import Sender
from rig.options import AudioOptions, DeviceOptions, OutputOptions, PageOptions, RecordOptions, RoomOptions
from rig.recording.options import RecordingOptions
from rig.supervision.parts import ACCESS, HAPTIC, PANEL, RECORD, SOUND
from sound_server.options import SoundOptions
from sound_server.outputs import outputs_of
from web_panel.options import LanOptions, PanelOptions


@dataclass(frozen=True)
class Options(DeviceOptions, OutputOptions, AudioOptions, RoomOptions, PageOptions, RecordOptions):
    """Options of a rig's processes, from the command line and the rig file; defaults are those of the commands."""

    rig: str
    folder: Path
    state: Path
    parts: frozenset[str] = field(default_factory=lambda: frozenset({HAPTIC, ACCESS, SOUND, PANEL}))
    connect: str | None = None
    listen: str = DEFAULT_ROUTER
    public: Public | None = None  # where other machines come in
    identity: Identity | None = None  # of clients, when they go to another machine
    osc_bind: tuple[str, int] = DEFAULT_IN
    osc_targets: tuple[str, ...] = (DEFAULT_TARGET,)
    osc_allow: tuple[str, ...] = ()  # networks that may send OSC; empty: loopback
    query: tuple[str, int] | None = None  # where OSCQuery is served
    page_lan: tuple[str, int] | None = None  # where the page is open to the network
    audio_awaited: bool = False  # play for nobody while its device is not there

    @property
    def router(self) -> str:
        """The Zenoh endpoint that clients use."""
        return self.connect or self.listen

    @property
    def is_router(self) -> bool:
        """True when this rig's own gateway is the Zenoh router."""
        return HAPTIC in self.parts and self.connect is None

    @property
    def osc_sender(self) -> Sender:
        """OSC targets and prefix, for the other rigs of this machine."""
        return Sender(self.rig, self.osc_targets, self.prefix)


def commands(options: Options) -> dict[str, list[str]]:
    """Name -> command line, in the order of starting. Raises CommandError."""
    plan: dict[str, tuple[str, ServiceOptions]] = {}
    if HAPTIC in options.parts:
        held = options.pose_is_held
        servo = ServoOptions(run_dir=options.folder, device=options.device, pose_is_held=held)
        plan["servo"] = "haptic_server.servo", servo
        plan["gateway"] = "haptic_server.gateway", _gateway(options)
    if ACCESS in options.parts and options.public is not None:
        access = AccessOptions(connect=options.router, public=options.public)
        plan[ACCESS] = "haptic_server.access", access
    if SOUND in options.parts:
        plan["sound"] = "sound_server", _sound(options)
    if PANEL in options.parts:
        plan["panel"] = "web_panel", _panel(options)
    if options.record is not None:
        recording = RecordingOptions(
            rig=options.rig, connect=options.router, identity=options.identity, out=options.record,
            force=options.record_force,
        )  # fmt: skip
        plan[RECORD] = "rig.recording", recording
    try:
        return {name: command(*started) for name, started in plan.items()}
    except ValueError as error:
        usage_error(str(error))


def next_servo(options: Options, turn: int) -> list[str]:
    """Command line of the servo that is made ready for another scene; `turn`: descriptor of the pipe by which it gets
    its turn. Raises CommandError."""
    given = ServoOptions(
        run_dir=options.folder, device=options.device, pose_is_held=options.pose_is_held, turn=turn
    )
    return command("haptic_server.servo", given)


def _address(target: str) -> tuple[str, int]:
    host, _, port = target.rpartition(":")
    return host, int(port)


def _gateway(options: Options) -> GatewayOptions:
    return GatewayOptions(
        run_dir=options.folder, state_dir=options.state, rig=options.rig, listen=options.listen,
        connect=options.connect, identity=options.identity if options.connect else None,
        osc_in=options.osc_bind, osc_out=tuple(map(_address, options.osc_targets)),
        osc_allow=options.osc_allow, prefix=options.prefix, fresh=options.fresh, supervised=True,
        oscquery=options.query, oscquery_announce=options.oscquery_announce, midi_out=options.midi_out,
        midi_note=options.midi_note, midi_channel=options.midi_channel, midi_in=options.midi_in,
        midi_in_notes=tuple(places_of(options.midi_in_notes).items()) if options.midi_in_notes else (),
        midi_in_curve=options.midi_in_curve, midi_in_channel=options.midi_in_channel,
    )  # fmt: skip


def _sound(options: Options) -> SoundOptions:
    return SoundOptions(
        rigs=tuple(dict.fromkeys((options.rig, *(options.also or ())))), most_rigs=options.most_rigs,
        connect=options.router, identity=options.identity, audio=options.audio, rate=options.audio_rate,
        block=options.audio_block, awaited=options.audio_awaited, room_latency_ms=options.room_latency,
        room_level_dB=options.room_level, outputs=outputs_of(options.outputs) if options.outputs else (),
    )  # fmt: skip


def _panel(options: Options) -> PanelOptions:
    return PanelOptions(
        token_file=options.folder / "panel-token", rig=options.rig, connect=options.router,
        identity=options.identity, port=options.panel_port, accuracy_shipped=SHIPPED,
        accuracy_own=accuracy_folder() / FILE, lan=_lan(options),
    )  # fmt: skip


def _lan(options: Options) -> LanOptions | None:
    if options.page_lan is None:
        return None
    host, port = options.page_lan
    certificate, key = page_certificate(options.state, host)
    return LanOptions(
        host=host, port=port, certificate=certificate, private_key=key, in_terminal=sys.stderr.isatty()
    )
