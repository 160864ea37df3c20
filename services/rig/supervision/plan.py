"""Which processes a rig consists of, and the command line of each. Services are started, never imported."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

from protocol.access.identity import Identity
from protocol.keys import DEFAULT_ROUTER
from protocol.session import Public
from rig.accuracy_files import FILE, SHIPPED
from rig.folder import accuracy_folder

HAPTIC, SOUND, PANEL = "haptic", "sound", "panel"
RECORD, DOOR = "record", "door"
NOT_ESSENTIAL = frozenset({RECORD})  # whose end never ends a rig


@dataclass(frozen=True)
class Options:
    """What the user chose; the defaults are those of the commands."""

    rig: str
    folder: Path
    state: Path
    device: str = "simulated"
    pose_is_held: bool = False
    audio: str = "auto"
    connect: str | None = None
    listen: str = DEFAULT_ROUTER
    osc_in: int = 9100
    osc_out: tuple[str, ...] = ("127.0.0.1:9101",)
    prefix: str = "/drumstick"
    panel_port: int = 8080
    audio_rate: int = 48000  # Hz
    audio_block: int = 128  # frames
    audio_awaited: bool = False  # play for nobody while its device is not there
    fresh: bool = False  # start from the scene, not from the last good set
    also: tuple[str, ...] = ()  # further rigs whose drums the sound server plays; with *, as they come and go
    most_rigs: int = 8
    room_latency_ms: float = 0.0
    room_level_dB: float = 0.0
    parts: frozenset[str] = field(default_factory=lambda: frozenset({HAPTIC, DOOR, SOUND, PANEL}))
    record: Path | None = None  # the MCAP file to record into
    record_force: bool = False  # also the contacts' force
    osc_host: str = "127.0.0.1"
    osc_allow: tuple[str, ...] = ()  # networks that may send OSC; empty: loopback
    public: Public | None = None  # where other machines come in
    identity: Identity | None = None  # of clients, when they go to another machine
    oscquery: tuple[str, int] | None = None  # where OSCQuery is served
    oscquery_announce: bool = False
    midi_out: str | None = None  # part of a port's name, or "virtual"
    midi_note: int = 38
    midi_channel: int = 10

    @property
    def router(self) -> str:
        """The Zenoh endpoint that clients use."""
        return self.connect or self.listen

    @property
    def is_router(self) -> bool:
        """Whether this rig's own gateway is the Zenoh router."""
        return HAPTIC in self.parts and self.connect is None


def _extras(options: Options) -> list[str]:
    words: list[str] = []
    if options.oscquery is not None:
        host, port = options.oscquery
        words += ["--oscquery", f"{host}:{port}"]
    if options.oscquery_announce:
        words.append("--oscquery-announce")
    if options.midi_out is not None:
        words += [f"--midi-out={options.midi_out}", "--midi-note", str(options.midi_note)]
        words += ["--midi-channel", str(options.midi_channel)]
    return words


def commands(options: Options) -> dict[str, list[str]]:
    """Name -> command line, in the order of starting."""
    python = [sys.executable, "-m"]
    rig = ["--rig", options.rig]
    router = ["--connect", options.router, *(options.identity.options() if options.identity else [])]
    folder = ["--run-dir", str(options.folder)]
    plan: dict[str, list[str]] = {}
    if HAPTIC in options.parts:
        plan["servo"] = [*python, "haptic_server.servo", *folder, "--device", options.device]
        if options.pose_is_held:
            plan["servo"].append("--pose-is-held")
        osc = ["--osc-in", f"{options.osc_host}:{options.osc_in}", "--prefix", options.prefix]
        osc += [] if options.osc_out else ["--no-osc-out"]
        for target in options.osc_out:
            osc += ["--osc-out", target]
        for network in options.osc_allow:
            osc += ["--osc-allow", network]
        zenoh = router if options.connect else ["--listen", options.listen]
        kept = ["--state-dir", str(options.state), *(["--fresh"] if options.fresh else []), "--supervised"]
        plan["gateway"] = [
            *python, "haptic_server.gateway", *folder, *rig, *osc, *zenoh, *kept, *_extras(options)
        ]  # fmt: skip
    if DOOR in options.parts and options.public is not None:
        plan[DOOR] = [*python, "haptic_server.access", "--connect", options.router, *_public(options.public)]
    if SOUND in options.parts:
        plan["sound"] = [*python, "sound_server", *router, *_sound(options)]
    if PANEL in options.parts:
        its_own = ["--token-file", str(options.folder / "panel-token")]
        its_own += ["--accuracy-shipped", str(SHIPPED)]
        its_own += ["--accuracy-own", str(accuracy_folder() / FILE)]
        plan["panel"] = [*python, "web_panel", *rig, *router, "--port", str(options.panel_port), *its_own]
    if options.record is not None:
        plan[RECORD] = [*python, "rig.recording", *rig, *router, "--out", str(options.record)]
        if options.record_force:
            plan[RECORD].append("--force")
    return plan


def _sound(options: Options) -> list[str]:
    words = ["--rig", ",".join((options.rig, *options.also)), "--most-rigs", str(options.most_rigs)]
    words += [f"--room-latency={options.room_latency_ms!r}", f"--room-level={options.room_level_dB!r}"]
    words += ["--audio", options.audio, "--rate", str(options.audio_rate)]
    words += ["--block", str(options.audio_block)]
    return [*words, "--awaited"] if options.audio_awaited else words


def _public(public: Public) -> list[str]:
    admitted = ["--admit", ",".join(public.roles), "--carry", ",".join(public.rigs)]
    return ["--public", public.endpoint, *admitted, *public.identity.options()]
