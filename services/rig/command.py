"""The `drumstick` command line. Everything heavy is imported inside a command: --help must be instant."""

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER
from rig.fault import LACKING, Stop

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="The haptic drumstick: play it, hear it, tune it, send its strikes as OSC.",
)
scenes = typer.Typer(no_args_is_help=True, help="Scenes: what is simulated, with which numbers.")
params = typer.Typer(no_args_is_help=True, help="Parameters of a running rig.")
presets = typer.Typer(no_args_is_help=True, help="Sets of parameters by name, kept by the haptic machine.")
app.add_typer(scenes, name="scene")
app.add_typer(params, name="params")
app.add_typer(presets, name="preset")
keys = typer.Typer(no_args_is_help=True, help="Certificates: who may speak to a rig from another machine.")
app.add_typer(keys, name="keys")

_SCENE = typer.Option(help="A shipped scene or a .toml file.")
_RIG = typer.Option(help="Name of the rig on the wire.")
_CONNECT = typer.Option(help="Zenoh router to use, e.g. tcp/127.0.0.1:7447.")
_LISTEN_WORDS = "Without --connect this rig is the Zenoh router itself, at this loopback endpoint."
_RIG_FILE = typer.Option("--rig-file", help="Who the rig is on the network, and who may speak to it (TOML).")
_DURATION = typer.Option(help="Stop after this many seconds of play.")
_JSON = typer.Option("--json", help="Print one JSON object and nothing else on stdout.")
_AUDIO = typer.Option(help="auto, null, wav:FILE, or part of an audio device's name.")
_AUDIO_RATE = typer.Option(
    help="Frames a second, 22050 to 192000; a device that has only one rate keeps its own."
)
_AUDIO_BLOCK = typer.Option(help="Frames a block, 16 to 8192: shorter is sooner heard and sooner late.")
_PANEL_PORT = typer.Option(help="TCP port of the technician's page, on 127.0.0.1.")
_OSC_IN_WORDS = "UDP port to hear OSC at, on 127.0.0.1 or where the rig file says."
_OSC_OUT = typer.Option(help="host:port that gets the strikes as OSC; may be repeated.")
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
_MIDI_NOTE = typer.Option(help="MIDI note of a strike, 0 to 127.")
_MIDI_CHANNEL = typer.Option(help="MIDI channel of strikes, 1 to 16.")
_FRESH = typer.Option("--fresh", help="Start with the scene's parameters, not with those of last time.")
_OUT = typer.Option(help="Also write figures (PNG, SVG), tables (CSV) and analysis.json into this folder.")
_SWEEP = typer.Option(
    help="NAME=LOW:HIGH:COUNT[:log], with --out: sweep this parameter instead of the usual ones; twice: a plane."
)
_RECORD = typer.Option(help="Also record what the rig does into this new MCAP file.")
_RECORD_FORCE = typer.Option("--record-force", help="Also the contacts' force, of a scene that streams it.")
_POSE = "You hold a real arm in its neutral pose now, so that its encoders may be reset (docs/phantom.md)."
_DEVICE = typer.Option(
    help="simulated, pointer (mouse or touch on the panel), openhaptics, or replay:FILE (CSV with t_s and z_m)."
)

Scene = Annotated[str, _SCENE]
RigName = Annotated[str, _RIG]
Connect = Annotated[str | None, _CONNECT]
Duration = Annotated[float | None, _DURATION]
# What a rig file may say too: not given is not the same as given the default.
RigFile = Annotated[Path | None, _RIG_FILE]
RigNameOrFile = Annotated[
    str | None, typer.Option(help="Name of the rig on the wire.", show_default=DEFAULT_RIG)
]
ListenOrFile = Annotated[str | None, typer.Option(help=_LISTEN_WORDS, show_default=DEFAULT_ROUTER)]
OscInOrFile = Annotated[int | None, typer.Option(help=_OSC_IN_WORDS, show_default="9100")]
Json = Annotated[bool, _JSON]
Audio = Annotated[str, _AUDIO]
AudioRate = Annotated[int, _AUDIO_RATE]
AudioBlock = Annotated[int, _AUDIO_BLOCK]
PanelPort = Annotated[int, _PANEL_PORT]
OscOut = Annotated[list[str] | None, _OSC_OUT]
Prefix = Annotated[str, _PREFIX]
OscQuery = Annotated[str | None, _OSCQUERY]
OscQueryAnnounce = Annotated[bool, _OSCQUERY_ANNOUNCE]
MidiOut = Annotated[str | None, _MIDI_OUT]
MidiNote = Annotated[int, _MIDI_NOTE]
MidiChannel = Annotated[int, _MIDI_CHANNEL]
Device = Annotated[str, _DEVICE]
Fresh = Annotated[bool, _FRESH]
PresetName = Annotated[str, typer.Argument(help="1 to 60 letters, digits, spaces, _ . or -")]
PoseIsHeld = Annotated[bool, typer.Option("--pose-is-held", help=_POSE)]
Record = Annotated[Path | None, _RECORD]
RecordForce = Annotated[bool, _RECORD_FORCE]
SceneName = Annotated[str, typer.Argument(help="A shipped scene or a .toml file.")]


Also = Annotated[
    list[str] | None, typer.Option(help="Another rig whose drum to play as well; may be repeated.")
]


def _run(
    part: frozenset[str],
    rig_file: Path | None,
    rig: str | None,
    duration: float | None,
    as_json: bool,
    *,
    scene: str = "roll",
    device: str = "simulated",
    pose_is_held: bool = False,
    audio: str = "auto",
    connect: str | None = None,
    listen: str | None = None,
    osc_in: int | None = None,
    osc_out: list[str] | None = None,
    prefix: str = "/drumstick",
    panel_port: int = 8080,
    fresh: bool = False,
    also: list[str] | None = None,
    audio_rate: int = 48000,
    audio_block: int = 128,
    record: Path | None = None,
    record_force: bool = False,
    oscquery: str | None = None,
    oscquery_announce: bool = False,
    midi_out: str | None = None,
    midi_note: int = 38,
    midi_channel: int = 10,
) -> None:
    from rig import checks, folder
    from rig.plan import Options
    from rig.settled import settle
    from rig.up import up

    for name in also or ():
        checks.rig_name(name)
    checks.port(panel_port, "--panel-port")
    checks.finite(audio_rate, "--audio-rate", 22050.0, 192000.0, "Hz")
    checks.finite(audio_block, "--audio-block", 16.0, 8192.0, "frames")
    checks.duration(duration)
    checks.prefix(prefix)
    checks.device(device)
    query = checks.oscquery(oscquery, oscquery_announce)
    if midi_out is not None:
        checks.midi(midi_out, midi_note, midi_channel)
    if midi_out == "list":
        from rig.midi_ports import show

        show(as_json)
        return
    ends = settle(
        part, rig_file, rig=rig, connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out
    )  # fmt: skip
    host, port = ends.osc_bind
    options = Options(
        ends.rig, folder.run_folder(ends.rig), folder.state_folder(ends.rig), device=device,
        pose_is_held=pose_is_held, audio=audio, connect=ends.connect, listen=ends.listen, osc_in=port,
        osc_out=ends.osc_targets, prefix=prefix, panel_port=panel_port, audio_rate=audio_rate,
        audio_block=audio_block, fresh=fresh, also=tuple(also or ()), parts=part, record=record,
        record_force=record_force, osc_host=host, osc_allow=ends.osc_allow, public=ends.public,
        identity=ends.identity, oscquery=query, oscquery_announce=oscquery_announce, midi_out=midi_out,
        midi_note=midi_note, midi_channel=midi_channel,
    )  # fmt: skip
    up(options, scene, duration, as_json)


@app.command("up")
def up_command(
    scene: Scene = "roll",
    duration: Duration = None,
    device: Device = "simulated",
    pose_is_held: PoseIsHeld = False,
    audio: Audio = "auto",
    audio_rate: AudioRate = 48000,
    audio_block: AudioBlock = 128,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    listen: ListenOrFile = None,
    osc_in: OscInOrFile = None,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    panel_port: PanelPort = 8080,
    fresh: Fresh = False,
    record: Record = None,
    record_force: RecordForce = False,
    oscquery: OscQuery = None,
    oscquery_announce: OscQueryAnnounce = False,
    midi_out: MidiOut = None,
    midi_note: MidiNote = 38,
    midi_channel: MidiChannel = 10,
    as_json: Json = False,
) -> None:
    """Play: force loop, sound and panel together, until Ctrl-C."""
    _run(
        frozenset({"haptic", "sound", "panel"}), rig_file, rig, duration, as_json, scene=scene, device=device,
        pose_is_held=pose_is_held, audio=audio, audio_rate=audio_rate, audio_block=audio_block,
        connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out, prefix=prefix, panel_port=panel_port,
        fresh=fresh, record=record, record_force=record_force,
        oscquery=oscquery, oscquery_announce=oscquery_announce,
        midi_out=midi_out, midi_note=midi_note, midi_channel=midi_channel,
    )  # fmt: skip


@app.command("haptic")
def haptic_command(
    scene: Scene = "roll",
    duration: Duration = None,
    device: Device = "simulated",
    pose_is_held: PoseIsHeld = False,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    listen: ListenOrFile = None,
    osc_in: OscInOrFile = None,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    fresh: Fresh = False,
    record: Record = None,
    record_force: RecordForce = False,
    oscquery: OscQuery = None,
    oscquery_announce: OscQueryAnnounce = False,
    midi_out: MidiOut = None,
    midi_note: MidiNote = 38,
    midi_channel: MidiChannel = 10,
    as_json: Json = False,
) -> None:
    """Only the force loop and its gateway."""
    _run(
        frozenset({"haptic"}), rig_file, rig, duration, as_json, scene=scene, device=device,
        pose_is_held=pose_is_held, connect=connect, listen=listen, osc_in=osc_in, osc_out=osc_out, prefix=prefix,
        fresh=fresh, record=record, record_force=record_force,
        oscquery=oscquery, oscquery_announce=oscquery_announce,
        midi_out=midi_out, midi_note=midi_note, midi_channel=midi_channel,
    )  # fmt: skip


@app.command("sound")
def sound_command(
    audio: Audio = "auto",
    audio_rate: AudioRate = 48000,
    audio_block: AudioBlock = 128,
    duration: Duration = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    also: Also = None,
    as_json: Json = False,
) -> None:
    """Only the sound server; each rig's scene comes from its haptic server."""
    _run(
        frozenset({"sound"}), rig_file, rig, duration, as_json, audio=audio, connect=connect, also=also,
        audio_rate=audio_rate, audio_block=audio_block,
    )  # fmt: skip


@app.command("panel")
def panel_command(
    panel_port: PanelPort = 8080,
    duration: Duration = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Only the technician's page."""
    _run(frozenset({"panel"}), rig_file, rig, duration, as_json, connect=connect, panel_port=panel_port)


@app.command("simulate")
def simulate_command(
    scene: SceneName,
    duration: Annotated[float, typer.Option(help="Simulated seconds.")] = 2.0,
    v0: Annotated[float, typer.Option("--v0", help="Upward speed at the start, m/s.")] = 0.4,
    method: Annotated[
        str,
        typer.Option(help="exact (no time step), semi_implicit_euler, verlet, rk4 or implicit_midpoint."),
    ] = "exact",
    dt: Annotated[float | None, typer.Option(help="Time step of a stepper, s; 1e-5 if not given.")] = None,
    events: Annotated[
        bool, typer.Option(help="Whether a stepper finds the instants of contact, or sees them a step late.")
    ] = True,
    as_json: Json = False,
) -> None:
    """The contacts of a scene's stick: exact, or by a stepper to see what its step costs."""
    from rig import checks
    from rig.simulate import simulate

    checks.duration(duration)
    checks.finite(v0, "--v0", -100.0, 100.0, "m/s")
    simulate(scene, duration, v0, method, dt, events, as_json)


@app.command("render")
def render_command(
    scene: SceneName,
    out: Annotated[Path, typer.Option(help="The WAV file to write.")],
    duration: Annotated[
        float | None, typer.Option(help="Seconds of sound; 3, or all of a recording, if not given.")
    ] = None,
    strikes: Annotated[
        Path | None,
        typer.Option(
            help="Strikes to play: CSV with t_s, x, y, speed_m_per_s, or a recording (.mcap). Without it, one at half"
            " radius."
        ),
    ] = None,
    roll: Annotated[bool, typer.Option("--roll", help="Play what the scene's own stick does.")] = False,
    rate: Annotated[int, typer.Option(help="Samples a second.")] = 48000,
    spectrogram: Annotated[
        Path | None, typer.Option(help="Also draw the sound's spectrogram (PNG or SVG).")
    ] = None,
    modes: Annotated[
        Path | None, typer.Option(help="Also draw the drum's modes beside the ideal membrane's (PNG or SVG).")
    ] = None,
    as_json: Json = False,
) -> None:
    """A scene's drum into a WAV file, offline."""
    from rig import checks
    from rig.render import Wishes, render

    checks.duration(duration)
    checks.finite(rate, "--rate", 22050.0, 192000.0, "Hz")
    seconds = 3.0 if duration is None else duration
    wishes = Wishes(out, seconds, strikes, roll, rate, spectrogram, modes)
    render(scene, wishes, as_json, whole=duration is None)


@app.command("analyse")
def analyse_command(
    scene: SceneName,
    out: Annotated[Path | None, _OUT] = None,
    sweep: Annotated[list[str] | None, _SWEEP] = None,
    as_json: Json = False,
) -> None:
    """Restitution, capture, fixed points and their stability; the paper's v_lc beside the exact one."""
    from rig.analyse import analyse

    analyse(scene, as_json, out, sweep or [])


@app.command("servo-test")
def servo_test_command(
    scene: Scene = "roll",
    seconds: Annotated[float, typer.Option(help="How long to watch the loop.")] = 10.0,
    as_json: Json = False,
) -> None:
    """Ten seconds of the force loop: how late it is, and whether this machine is fit for it."""
    from rig import checks
    from rig.servo_test import servo_test

    checks.finite(seconds, "--seconds", 0.5, 3600.0, "s")
    servo_test(scene, seconds, as_json)


@app.command("doctor")
def doctor_command(rig: RigNameOrFile = None, rig_file: RigFile = None, as_json: Json = False) -> None:
    """What this machine has and lacks for playing; the rig's last fault here, drawn; whom it turned away."""
    from rig.doctor import doctor

    raise typer.Exit(doctor(as_json, rig, rig_file))


@app.command("record")
def record_command(
    out: Annotated[Path, typer.Option(help="The new MCAP file; one that exists is never overwritten.")],
    force: Annotated[
        bool, typer.Option("--force", help="Also the contacts' force, of a scene that streams it.")
    ] = False,
    duration: Annotated[float | None, typer.Option(help="Stop after this many seconds.")] = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Record a running rig: strikes, parameters, state, meters; until Ctrl-C."""
    from rig import checks
    from rig.record import record
    from rig.settled import far_end

    checks.duration(duration)
    endpoint, rig_keys, identity = far_end(rig_file, rig, connect, only_reads=True)
    record(endpoint, rig_keys, out, force, duration, as_json, identity)


@app.command("replay")
def replay_command(
    file: Annotated[
        Path, typer.Argument(help="A recording, .mcap; one that was cut off plays as far as it goes.")
    ],
    speed: Annotated[float, typer.Option(help="Times the recorded speed; a contact keeps its length.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Again and again, until Ctrl-C.")] = False,
    await_sound: Annotated[
        bool, typer.Option("--await-sound", help="Begin when a sound server of this rig is there.")
    ] = False,
    rig: RigName = "main",
    connect: Connect = None,
    listen: Annotated[str, typer.Option(help=_LISTEN_WORDS)] = DEFAULT_ROUTER,
    osc_out: OscOut = None,
    prefix: Prefix = "/drumstick",
    as_json: Json = False,
) -> None:
    """Play a recording over Zenoh and OSC, in the haptic server's place."""
    from rig import checks
    from rig.replay import checked_wishes, replay

    _, keys = checks.wire(rig, connect)
    out = osc_out or ["127.0.0.1:9101"]
    replay(keys, checked_wishes(file, speed, loop, await_sound, listen, connect, out, prefix), as_json)


@app.command("panic")
def panic_command(rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None) -> None:
    """Zero force at once, latched."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect)
    remote.panic(endpoint, rig_keys, identity)


@app.command("arm")
def arm_command(rig: RigName = "main") -> None:
    """Clear a panic or a fault; only on the haptic machine."""
    from rig import arm, checks

    checks.rig_name(rig)
    arm.arm(rig)


@scenes.command("list")
def scene_list(as_json: Json = False) -> None:
    """The shipped scenes."""
    from rig import scenes_shown

    scenes_shown.show_list(as_json)


@scenes.command("show")
def scene_show(scene: SceneName, as_json: Json = False) -> None:
    """A scene with every default written out (--json), or its text."""
    from rig import scenes_shown

    scenes_shown.show(scene, as_json)


@scenes.command("check")
def scene_check(scene: SceneName) -> None:
    """Say everything that is wrong with a scene."""
    from rig import scenes_shown

    scenes_shown.check(scene)


@scenes.command("cost")
def scene_cost(scene: SceneName, as_json: Json = False) -> None:
    """What each effect and the mesh cost per tick and per sample here, and what accuracy that buys."""
    from rig.scene_cost import cost

    cost(scene, as_json)


@params.command("get")
def params_get(
    names: Annotated[list[str] | None, typer.Argument(help="Wire names; none means all.")] = None,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """What the servo uses now."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect, only_reads=True)
    remote.params_get(endpoint, rig_keys, names or [], as_json, identity)


@params.command("set")
def params_set(
    pairs: Annotated[list[str], typer.Argument(help="NAME=VALUE ..., all accepted or none.")],
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Set parameters while it plays."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect)
    remote.params_set(endpoint, rig_keys, pairs, as_json, identity)


@params.command("watch")
def params_watch(
    rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None, duration: Duration = None
) -> None:
    """Print every accepted change."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect, only_reads=True)
    remote.params_watch(endpoint, rig_keys, duration, identity)


@keys.command("make")
def keys_make(
    out: Annotated[Path, typer.Option(help="A new folder; it gets one folder for each machine to carry.")],
    rig: RigNameOrFile = None,
    host: Annotated[
        list[str] | None,
        typer.Option(help="Name or address by which others reach the haptic machine; may be repeated."),
    ] = None,
    days: Annotated[int, typer.Option(help="How long the certificates are valid, 1 to 825.")] = 365,
    renew: Annotated[
        str | None, typer.Option(help="Make only this role's certificate anew, by the authority in --out.")
    ] = None,
) -> None:
    """A small authority, and a certificate for each role: haptic, sound, panel, technician, listener."""
    from rig import checks
    from rig import keys as rig_keys

    checks.finite(days, "--days", 1.0, rig_keys.LONGEST_DAYS, "days")
    if renew is None:
        rig_keys.make(out, rig, host or [], days)
    else:
        rig_keys.renew(out, renew, host or [], days)


@keys.command("show")
def keys_show(
    folder: Annotated[Path, typer.Argument(help="A folder that `keys make` made, or one of its folders.")],
    as_json: Json = False,
) -> None:
    """Who each certificate is for, and until when."""
    from rig import keys as rig_keys

    rig_keys.show(folder, as_json)


@presets.command("save")
def preset_save(
    name: PresetName, rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None
) -> None:
    """Keep the parameters as they are now, on the haptic machine."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect)
    remote.preset_save(endpoint, rig_keys, name, identity)


@presets.command("load")
def preset_load(
    name: PresetName,
    rig: RigNameOrFile = None,
    rig_file: RigFile = None,
    connect: Connect = None,
    as_json: Json = False,
) -> None:
    """Set everything that the preset holds, or nothing."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect)
    remote.preset_load(endpoint, rig_keys, name, as_json, identity)


@presets.command("list")
def preset_list(
    rig: RigNameOrFile = None, rig_file: RigFile = None, connect: Connect = None, as_json: Json = False
) -> None:
    """Every preset of the rig."""
    from rig import remote
    from rig.settled import far_end

    endpoint, rig_keys, identity = far_end(rig_file, rig, connect)
    remote.preset_list(endpoint, rig_keys, as_json, identity)


def _leave(status: int, message: str) -> NoReturn:
    if message:
        print(f"drumstick: {message}", file=sys.stderr)
    sys.exit(status)


def main() -> None:
    """Entry point; exit status 0 done, 2 what was given is wrong, 3 the machine lacks something, 1 a fault of ours."""
    try:
        app(prog_name=Path(sys.argv[0]).name)
    except Stop as stop:
        _leave(stop.status, str(stop))
    except KeyboardInterrupt:
        _leave(130, "interrupted")
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output went away, as `head` does
        sys.exit(0)
    except OSError as error:  # a full disk, a folder that may not be written: the machine's, not ours
        _leave(LACKING, str(error))
