"""Checked options of one rig's processes, from the command line and the rig file."""

import dataclasses
import logging
import socket
from typing import Any

from protocol.endpoint import host_and_port
from realtime.log import say
from rig import checks, folder, service_checks
from rig.exit_status import unavailable
from rig.network.ports import free_port
from rig.options import EndpointOptions, RigOptions
from rig.supervision.parts import PANEL
from rig.supervision.plan import Options
from rig.supervision.resolved_options import resolve

Group = Any  # one of rig.options


def checked_options(parts: frozenset[str], given_rig: RigOptions, *groups: Group) -> Options:
    """The options of a rig of these parts, from the groups that its command has. Raises CommandError."""
    given: dict[str, Any] = {}
    for group in groups:
        given |= {field.name: getattr(group, field.name) for field in dataclasses.fields(group)}
    named = {field.name: given.pop(field.name, None) for field in dataclasses.fields(EndpointOptions)}
    endpoints = EndpointOptions(**named)
    found = resolve(
        parts, given_rig.rig_file,
        rig=given_rig.rig, connect=given_rig.connect,
        listen=endpoints.listen, osc_in=endpoints.osc_in, osc_out=endpoints.osc_out,
    )  # fmt: skip
    options = Options(
        found.rig, folder.run_folder(found.rig), folder.state_folder(found.rig), parts=parts,
        connect=found.connect, listen=found.listen, public=found.public, identity=found.identity,
        osc_bind=found.osc_bind, osc_targets=found.osc_targets, osc_allow=found.osc_allow, **given,
    )  # fmt: skip
    _check(options)
    lan = (
        checks.panel_lan(options.panel_lan, options.panel_lan_at, found.panel_lan, options.panel_port)
        if PANEL in parts
        else None
    )
    query = checks.oscquery(options.oscquery, options.oscquery_announce)
    return dataclasses.replace(options, query=query, page_lan=lan)


def _check(options: Options) -> None:
    service_checks.room(options.room_latency, options.room_level)
    checks.port(options.panel_port, "--panel-port")
    service_checks.audio(options.audio_rate, options.audio_block)
    checks.prefix(options.prefix)
    checks.device(options.device)
    if options.midi_out is not None:
        service_checks.midi(options.midi_out, options.midi_note, options.midi_channel)
    if options.midi_in is not None:
        service_checks.midi_in(
            options.midi_in, options.midi_in_notes, options.midi_in_curve, options.midi_in_channel
        )
    service_checks.sound_rigs(options.rig, options.also or (), options.most_rigs)
    service_checks.outputs(options.outputs, options.rig, options.also or ())


def with_free_ports(options: Options) -> Options:
    """These options, with a free port for OSC, Zenoh and the page where another program has it; says which.

    Raises CommandError where an address is none of this machine's.
    """

    # Nobody need listen there yet: programs that hear the strikes, and this rig's own router.
    hearing = [int(target.rpartition(":")[2]) for target in options.osc_targets]
    own: list[int] = []

    def free(kind: socket.SocketKind, host: str, port: int, what: str) -> int:
        promised = own if kind == socket.SOCK_STREAM else hearing
        try:
            found = free_port(kind, host, port, promised)
        except OSError as error:
            unavailable(f"{what} {host}:{port}: {error.strerror}")
        if found != port:
            say(logging.WARNING, f"drumstick: {what}: port {port} is taken; using {found}")
        return found

    host, port = options.osc_bind
    changed: dict[str, Any] = {"osc_bind": (host, free(socket.SOCK_DGRAM, host, port, "incoming OSC"))}
    if options.is_router:
        host, port = host_and_port(options.listen)
        found = free(socket.SOCK_STREAM, host, port, "Zenoh (name it to other commands with --connect)")
        own.append(found)
        changed["listen"] = f"{options.listen.rpartition(':')[0]}:{found}"
    if PANEL in options.parts:
        changed["panel_port"] = free(socket.SOCK_STREAM, "127.0.0.1", options.panel_port, "the page")
    return dataclasses.replace(options, **changed)
