"""Options of the commands: each once, with its type, default and help; those that belong together in a group.

A group is a dataclass: `rig.cli.grouped` makes a command's options of its fields, `rig.supervision.plan` processes.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from haptic_server.gateway.midi.encoding import CHANNELS, DEFAULT_CHANNEL, DEFAULT_NOTE, NOTES
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER
from protocol.osc import DEFAULT_IN, DEFAULT_OUT, DEFAULT_PREFIX
from rig.lan_address import DEFAULT_PORT
from sound_server.ranges import (
    BLOCKS,
    DEFAULT_BLOCK,
    DEFAULT_RATE_HZ,
    MAX_DELAY_MS,
    MAX_RIGS,
    RATES_HZ,
    GAINS_dB,
)

DEFAULT_SCENE = "roll"
_SCENE = typer.Option(help="A shipped scene or a .toml file.")
# deploy/drumstick-at names the rig and its file so: a command that takes neither is not in the way.
_RIG_VARIABLE, _RIG_FILE_VARIABLE = "DRUMSTICK_RIG", "DRUMSTICK_RIG_FILE"
_RIG = typer.Option(help="Name of the rig on the wire.", envvar=_RIG_VARIABLE, show_envvar=False)
_CONNECT = typer.Option(help="Zenoh router to use, e.g. tcp/127.0.0.1:7447.")
_LISTEN_WORDS = "Without --connect this rig is the Zenoh router itself, at this loopback endpoint."
_RIG_FILE = typer.Option(
    "--rig-file",
    help="This machine's rig file (TOML): name of the rig, certificate, addresses, who may come in (docs/security.md).",
    envvar=_RIG_FILE_VARIABLE,
    show_envvar=False,
)
_SET_LIST = typer.Option(
    metavar="FILE",
    help="Scenes to step through, one a line, in place of --scene: the first one plays (docs/play.md).",
)
_DURATION = typer.Option(help="Stop after this many seconds.")
_PLAY_DURATION = typer.Option(
    help="Stop after this many seconds of play; what starting takes is not counted."
)
_JSON = typer.Option("--json", help="Print one JSON object and nothing else on stdout.")
_AUDIO = typer.Option(
    help="auto (the default device; without one a WAV file, or as a systemd service silence until there is one),"
    " null (no sound), wav:FILE, or part of an audio device's name."
)
_PANEL_PORT = typer.Option(help="TCP port of the technician's page, on 127.0.0.1.")
_PANEL_LAN = typer.Option(
    "--panel-lan/--no-panel-lan",
    show_default=False,
    help="Also open the page to phones and tablets on this network, over TLS and by a one-time login link, at port"
    f" {DEFAULT_PORT} of the address by which this machine reaches it (docs/panel.md). --no-panel-lan: on 127.0.0.1"
    " alone, whatever the rig file says.",
)
_PANEL_LAN_AT = typer.Option(
    metavar="ADDRESS",
    help="The same, at this address of this machine: 192.168.1.10, 192.168.1.10:8443, or a port.",
)
_OSC_IN_WORDS = "UDP port for incoming OSC, on 127.0.0.1 or where the rig file says."
_OSC_OUT = typer.Option(
    help=f"host:port that gets the strikes as OSC, instead of {DEFAULT_OUT[0]}:{DEFAULT_OUT[1]}; may be repeated."
)
_PREFIX = typer.Option(help="First part of every OSC address.")
_OSCQUERY = typer.Option(
    metavar="[HOST:]PORT",
    help="Also describe the OSC addresses to other programs (OSCQuery), at this TCP port.",
)
_OSCQUERY_ANNOUNCE = typer.Option(
    "--oscquery-announce", help="Announce OSCQuery by multicast DNS, though only this machine can reach it."
)
_MIDI_OUT = typer.Option(
    metavar="NAME",
    help="Also play the strikes as MIDI: part of a port's name, virtual, or list to see the ports.",
)
_FRESH = typer.Option("--fresh", help="Start with the scene's parameters, not with those of last time.")
_OUT = typer.Option(help="Also write figures (PNG, SVG), tables (CSV) and analysis.json into this folder.")
_SWEEP = typer.Option(
    help="NAME=LOW:HIGH:COUNT[:log], with --out: sweep this parameter instead of the usual ones; give it twice"
    " to sweep two parameters against each other."
)
_RECORD = typer.Option(help="Also record what the rig does into this new MCAP file.")
_RECORD_FORCE = typer.Option(
    "--record-force", help='Record contact force too (only for scenes with excitation = "streamed").'
)
_POSE = "Only for an arm whose encoders must be zeroed: somebody holds it in its neutral pose now (docs/phantom.md)."
_DEVICE = typer.Option(
    help="simulated, pointer (mouse or touch on the panel), openhaptics, replay:FILE (CSV with t_s and z_m),"
    " or the name of one in an installed package."
)

Scene = Annotated[str, _SCENE]
SetListFile = Annotated[Path | None, _SET_LIST]
RigName = Annotated[str, _RIG]
Connect = Annotated[str | None, _CONNECT]
Duration = Annotated[float | None, _DURATION]
PlayDuration = Annotated[float | None, _PLAY_DURATION]
# What a rig file may say too: not given is not the same as given the default.
RigFile = Annotated[Path | None, _RIG_FILE]
RigNameOrFile = Annotated[
    str | None,
    typer.Option(
        help="Name of the rig on the wire.", show_default=DEFAULT_RIG, envvar=_RIG_VARIABLE, show_envvar=False
    ),
]
ListenOrFile = Annotated[str | None, typer.Option(help=_LISTEN_WORDS, show_default=DEFAULT_ROUTER)]
OscInOrFile = Annotated[int | None, typer.Option(help=_OSC_IN_WORDS, show_default=str(DEFAULT_IN[1]))]
Json = Annotated[bool, _JSON]
Audio = Annotated[str, _AUDIO]
AudioRate = Annotated[
    int,
    typer.Option(
        help=f"Sample rate, {RATES_HZ[0]} to {RATES_HZ[1]} Hz; a device with only one rate keeps its own."
    ),
]
AudioBlock = Annotated[
    int,
    typer.Option(
        help=f"Frames per audio block, {BLOCKS[0]} to {BLOCKS[1]}. Smaller: lower latency, more risk of dropouts."
    ),
]
PanelPort = Annotated[int, _PANEL_PORT]
PanelLan = Annotated[bool | None, _PANEL_LAN]
PanelLanAt = Annotated[str | None, _PANEL_LAN_AT]
OscOut = Annotated[list[str] | None, _OSC_OUT]
Prefix = Annotated[str, _PREFIX]
OscQuery = Annotated[str | None, _OSCQUERY]
OscQueryAnnounce = Annotated[bool, _OSCQUERY_ANNOUNCE]
MidiOut = Annotated[str | None, _MIDI_OUT]
MidiNote = Annotated[int, typer.Option(help=f"MIDI note of a strike, {NOTES[0]} to {NOTES[1]}.")]
MidiChannel = Annotated[int, typer.Option(help=f"MIDI channel of strikes, {CHANNELS[0]} to {CHANNELS[1]}.")]
MidiIn = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Let notes play the drum: part of a MIDI port's name, virtual, or list to see the ports.",
    ),
]
MidiInNotes = Annotated[
    str,
    typer.Option(
        metavar="NOTE:X,...",
        help="Where notes strike, -1 to 1 of the radius, e.g. 36:0,38:0.4; others strike at 0.5.",
    ),
]
MidiInCurve = Annotated[
    float, typer.Option(help="Power of the velocity: below 1 plays louder, above 1 softer.")
]
MidiInChannel = Annotated[int, typer.Option(help="MIDI channel to listen to, 1 to 16; 0: all.")]
Device = Annotated[str, _DEVICE]
Fresh = Annotated[bool, _FRESH]
PresetName = Annotated[str, typer.Argument(help="1 to 60 letters, digits, spaces, _ . or -")]
PresetOldName = Annotated[str, typer.Argument(metavar="OLD", help="Its present name")]
PresetNewName = Annotated[str, typer.Argument(metavar="NEW", help="A name that no other preset has")]
PoseIsHeld = Annotated[bool, typer.Option("--pose-is-held", help=_POSE)]
Record = Annotated[Path | None, _RECORD]
RecordForce = Annotated[bool, _RECORD_FORCE]
SceneName = Annotated[str, typer.Argument(help="A shipped scene or a .toml file.")]
Also = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME|PATTERN",
        help="Another rig whose drum to play as well, or with * all of that pattern as they come and go, e.g."
        " 'stage-*' or '*'; may be repeated.",
    ),
]
MostRigs = Annotated[
    int,
    typer.Option(
        help=f"How many rigs to play at once, 1 to {MAX_RIGS}: each drum takes computing time and memory."
    ),
]
RoomLatency = Annotated[
    float, typer.Option(metavar="MS", help=f"Extra delay for this room, 0 to {MAX_DELAY_MS:g} ms.")
]
RoomLevel = Annotated[
    float,
    typer.Option(metavar="DB", help=f"Output gain for this room, {GAINS_dB[0]:g} to {GAINS_dB[1]:g} dB."),
]
OutputPairs = Annotated[
    str,
    typer.Option(
        metavar="RIG=L-R,...",
        help="Channels of the audio device for each rig, and for single pickups or microphones of it, e.g."
        " left-drum=1-2,right-drum=3-4,right-drum/microphone-1=5-6; what is not named is on 1-2.",
    ),
]
Listen = Annotated[str, typer.Option(help=_LISTEN_WORDS)]
Figures = Annotated[Path | None, _OUT]
Sweeps = Annotated[list[str] | None, _SWEEP]
MainPid = Annotated[str, typer.Argument(envvar="MAINPID", help="As systemd reports it: a process id.")]
ExitHow = Annotated[str, typer.Argument(envvar="EXIT_CODE", help="As systemd reports it: exited, killed ...")]
ExitStatus = Annotated[
    str, typer.Argument(envvar="EXIT_STATUS", help="As systemd reports it: a number or a signal.")
]


@dataclass(frozen=True, kw_only=True)
class RigOptions:
    """Name of the rig and its network; what is not given is as the rig file says."""

    rig: RigNameOrFile = None
    rig_file: RigFile = None
    connect: Connect = None


@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """Scene or set list to play, and for how long."""

    scene: Scene = DEFAULT_SCENE
    set_list: SetListFile = None
    duration: PlayDuration = None  # s


@dataclass(frozen=True, kw_only=True)
class DeviceOptions:
    """Device of the servo."""

    device: Device = "simulated"
    pose_is_held: PoseIsHeld = False


@dataclass(frozen=True, kw_only=True)
class EndpointOptions:
    """Network endpoints: where others connect and where strikes go; what is not given is as the rig file says."""

    listen: ListenOrFile = None
    osc_in: OscInOrFile = None
    osc_out: OscOut = None


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Optional parts of a gateway: memory of the last set, OSCQuery, MIDI."""

    prefix: Prefix = DEFAULT_PREFIX
    fresh: Fresh = False
    oscquery: OscQuery = None
    oscquery_announce: OscQueryAnnounce = False
    midi_out: MidiOut = None
    midi_note: MidiNote = DEFAULT_NOTE
    midi_channel: MidiChannel = DEFAULT_CHANNEL
    midi_in: MidiIn = None
    midi_in_notes: MidiInNotes = ""
    midi_in_curve: MidiInCurve = 1.0
    midi_in_channel: MidiInChannel = 0


@dataclass(frozen=True, kw_only=True)
class GatewayCliOptions(OutputOptions, EndpointOptions):
    """All of a gateway."""


@dataclass(frozen=True, kw_only=True)
class HapticOptions(GatewayCliOptions, DeviceOptions):
    """Servo and gateway."""


@dataclass(frozen=True, kw_only=True)
class AudioOptions:
    """Audio device, and the channels of it by which a rig or a microphone leaves."""

    audio: Audio = "auto"
    audio_rate: AudioRate = DEFAULT_RATE_HZ
    audio_block: AudioBlock = DEFAULT_BLOCK  # frames
    outputs: OutputPairs = ""


@dataclass(frozen=True, kw_only=True)
class RoomOptions:
    """Rigs that a sound server plays beside its own, and its room's delay and gain."""

    also: Also = None
    most_rigs: MostRigs = MAX_RIGS
    room_latency: RoomLatency = 0.0  # ms
    room_level: RoomLevel = 0.0  # dB


@dataclass(frozen=True, kw_only=True)
class PortOptions:
    """Ports that others have taken."""

    port: Annotated[
        Literal["auto"] | None,
        typer.Option(
            show_default=False,
            help="auto: where the port for OSC, for Zenoh or of the page is taken, use a free one, and say which.",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class PageOptions:
    """The technician's page."""

    panel_port: PanelPort = 8080
    panel_lan: PanelLan = None
    panel_lan_at: PanelLanAt = None


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """Recording: file and contents."""

    record: Record = None
    record_force: RecordForce = False


@dataclass(frozen=True, kw_only=True)
class PlaybackOptions:
    """Replay of a recording: speed, repetition, limits."""

    speed: Annotated[
        float, typer.Option(help="Playback speed: 2 is twice as fast; each contact keeps its own length.")
    ] = 1.0
    loop: Annotated[bool, typer.Option("--loop", help="Repeat until Ctrl-C.")] = False
    await_sound: Annotated[
        bool, typer.Option("--await-sound", help="Begin when a sound server of this rig is there.")
    ] = False
    longest: Annotated[
        float, typer.Option(metavar="SECONDS", help="Refuse a recording that would play for longer.")
    ] = 3600.0


@dataclass(frozen=True, kw_only=True)
class BesideSoundOptions:
    """Figures and stems beside a rendered sound."""

    spectrogram: Annotated[
        Path | None, typer.Option(help="Also draw the sound's spectrogram (PNG or SVG).")
    ] = None
    modes: Annotated[
        Path | None, typer.Option(help="Also draw the drum's modes beside the ideal membrane's (PNG or SVG).")
    ] = None
    stems: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Also write each pickup or microphone into a file of its own there: WAV of 32-bit floats, panned as in"
            " the mix, whose sum is the mix before its limiter.",
        ),
    ] = None
