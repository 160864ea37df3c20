"""Processes of a rig, and the command line of each. Services are started, never imported."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

from protocol.access.identity import Identity
from protocol.keys import DEFAULT_ROUTER
from protocol.session import Public
from rig.accuracy_files import FILE, SHIPPED
from rig.folder import accuracy_folder
from rig.options import AudioOptions, DeviceOptions, OutputOptions, PageOptions, RecordOptions, RoomOptions

HAPTIC, SOUND, PANEL = "haptic", "sound", "panel"
RECORD, ACCESS = "record", "door"
NOT_ESSENTIAL = frozenset({RECORD})  # whose end never ends a rig


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
    osc_host: str = "127.0.0.1"
    osc_port: int = 9100
    osc_targets: tuple[str, ...] = ("127.0.0.1:9101",)
    osc_allow: tuple[str, ...] = ()  # networks that may send OSC; empty: loopback
    query: tuple[str, int] | None = None  # where OSCQuery is served
    audio_awaited: bool = False  # play for nobody while its device is not there

    @property
    def router(self) -> str:
        """The Zenoh endpoint that clients use."""
        return self.connect or self.listen

    @property
    def is_router(self) -> bool:
        """True when this rig's own gateway is the Zenoh router."""
        return HAPTIC in self.parts and self.connect is None


def _extras(options: Options) -> list[str]:
    words: list[str] = []
    if options.query is not None:
        host, port = options.query
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
        osc = ["--osc-in", f"{options.osc_host}:{options.osc_port}", "--prefix", options.prefix]
        osc += [] if options.osc_targets else ["--no-osc-out"]
        for target in options.osc_targets:
            osc += ["--osc-out", target]
        for network in options.osc_allow:
            osc += ["--osc-allow", network]
        zenoh = router if options.connect else ["--listen", options.listen]
        kept = ["--state-dir", str(options.state), *(["--fresh"] if options.fresh else []), "--supervised"]
        plan["gateway"] = [
            *python, "haptic_server.gateway", *folder, *rig, *osc, *zenoh, *kept, *_extras(options)
        ]  # fmt: skip
    if ACCESS in options.parts and options.public is not None:
        plan[ACCESS] = [
            *python,
            "haptic_server.access",
            "--connect",
            options.router,
            *_public(options.public),
        ]
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
    words = ["--rig", ",".join((options.rig, *(options.also or ()))), "--most-rigs", str(options.most_rigs)]
    words += [f"--room-latency={options.room_latency!r}", f"--room-level={options.room_level!r}"]
    words += ["--audio", options.audio, "--rate", str(options.audio_rate)]
    words += ["--block", str(options.audio_block)]
    return [*words, "--awaited"] if options.audio_awaited else words


def _public(public: Public) -> list[str]:
    admitted = ["--admit", ",".join(public.roles), "--carry", ",".join(public.rigs)]
    return ["--public", public.endpoint, *admitted, *public.identity.options()]
