"""The OSC server: one UDP socket, one receive thread, everything that goes out and comes in by OSC."""

import logging
import math
import select
import socket
import threading
import time
from collections.abc import Callable, Sequence
from ipaddress import ip_network
from typing import TYPE_CHECKING

from haptic_server.gateway.osc.echo_filter import EchoFilter
from haptic_server.gateway.osc.inbound import Inbound, LoadPreset, Network
from haptic_server.gateway.osc.name_resolution import find, numeric, split
from haptic_server.gateway.osc.osc_sender import OscSender
from haptic_server.gateway.osc.outbound import Outbound
from haptic_server.gateway.osc.own_addresses import OwnAddress
from haptic_server.gateway.osc.prescan import MAX_BYTES
from haptic_server.gateway.osc.refusal_counts import RefusalCounts
from haptic_server.gateway.osc.reply_targets import ReplyTargets
from haptic_server.gateway.osc.targets import Endpoint, Targets
from haptic_server.gateway.played_strikes import NOBODY_PLAYS, Player
from haptic_server.gateway.settings import Parameters
from protocol import osc
from protocol.messages import Release, Strike, number_of

if TYPE_CHECKING:
    from haptic_server.gateway.rolls.rolls import Rolls
    from haptic_server.gateway.scenes.requests import SceneRequests

LOOPBACK: tuple[Network, ...] = (ip_network("127.0.0.0/8"), ip_network("::1/128"))
_LOG_DUE_MS = 1000  # how long a last line about a flood may stay unlogged
_AT_ONCE = 256
_log = logging.getLogger("osc")


class OscServer:
    """Hears at `bind`, sends to `targets` and to whoever subscribed; IPv4.

    The constructor opens the socket and starts the receive thread. It raises OSError when `bind` cannot be had,
    ValueError when the prefix cannot be used or a target is this server itself. A target whose name nobody knows gets
    what there is from then on when it is known. `now` gives seconds and stands for the clock. The methods that send
    may be called from any thread; they do not block, allocate, and never raise.
    """

    def __init__(
        self,
        bind: tuple[str, int],
        targets: Sequence[tuple[str, int]],
        prefix: str,
        parameters: Parameters,
        load_preset: LoadPreset,
        allow: Sequence[Network] = LOOPBACK,
        now: Callable[[], float] = time.monotonic,
        player: Player = NOBODY_PLAYS,
    ) -> None:
        self._prefix = osc.checked_prefix(prefix)
        self._now = now
        self._refusals = RefusalCounts()
        self._reply_targets = ReplyTargets()
        self._echo_filter = EchoFilter()
        known, names = split(targets)
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._udp.setblocking(False)
            self._udp.bind(numeric(bind))  # without SO_REUSEADDR: a taken port is an error
            host, port = self._udp.getsockname()
            self.endpoint: Endpoint = (str(host), int(port))
            self._own = OwnAddress(self.endpoint)
            if own := [f"{host}:{port}" for host, port in known if self._own.holds((host, port))]:
                raise ValueError(f"{own[0]} is the rig's own OSC input: send to another port")
        except BaseException:
            self._udp.close()
            raise
        self._targets = Targets(known)
        self._packets_out = OscSender(self._udp, self._refusals)
        outbound = Outbound(
            self._own,
            self._packets_out,
            self._targets,
            self._reply_targets,
            self._echo_filter,
            self._refusals,
        )
        self._inbound = Inbound(self._prefix, parameters, load_preset, allow, outbound, player, now)
        self._closing = threading.Event()
        find(names, self._found, self._closing)
        self._wake, self._woken = socket.socketpair()
        self._thread = threading.Thread(target=self._listen, name="osc", daemon=True)
        self._thread.start()

    @property
    def counters(self) -> dict[str, int]:
        """Counts of messages served, refused by reason, or not sent; a copy."""
        return self._refusals.counters()

    @property
    def addresses(self) -> frozenset[str]:
        """Every address that is heard."""
        return self._inbound.addresses

    @property
    def insiders(self) -> set[Endpoint]:
        """Exact senders that are heard besides the allowed sources: those of this process. Any thread may change it."""
        return self._inbound.insiders

    def strike(self, strike: Strike) -> None:
        """Send /strike, and then its mirrors: the stick met the head."""
        p = self._prefix
        self._send_all(
            lambda: [
                osc.strike(
                    p,
                    number_of(strike),
                    strike.x,
                    strike.y,
                    strike.z_speed_m_per_s,
                    strike.level,
                    strike.peak_estimate_N,
                )
            ]
        )
        self._send_all(
            lambda: [
                osc.level(p, strike.level),
                osc.x(p, strike.x),
                osc.y(p, strike.y),
                osc.gate(p, True),
            ]
        )

    def release(self, release: Release) -> None:
        """Send /release and /gate 0: the stick left the head."""
        p = self._prefix
        self._send_all(
            lambda: [
                osc.release(
                    p,
                    number_of(release),
                    release.exit_speed_m_per_s,
                    release.impulse_N_s,
                    release.peak_N,
                    release.contact_s,
                )
            ]
        )
        self.end_gate()

    def end_gate(self) -> None:
        """Send /gate 0 alone: no release is known of the contact, whose servo has ended."""
        self._send_all(lambda: [osc.gate(self._prefix, False)])

    def readback(self, name: str, value: float, norm: float) -> None:
        """Send what the servo uses now, to every target and to whoever set this value within the last second."""
        p, now_s = self._prefix, self._now()
        claimed = self._reply_targets.claim(name, value, now_s)
        if math.isfinite(value):
            self._echo_filter.note_value(name, value, claimed, now_s)
            self._echo_filter.note(
                name, value, [t for t in self._targets.present(now_s) if t not in claimed], now_s
            )
        self._send_all(lambda: [osc.param(p, name, value), osc.param_norm(p, name, norm)], claimed)

    def play_scene(self, parameters: Parameters, load_preset: LoadPreset, player: Player) -> None:
        """Hear the addresses of another scene from now on; `hear_rolls` and `hear_scenes` follow."""
        self._inbound.play_scene(parameters, load_preset, player)

    def scene_refused(self, why: str) -> None:
        """Send /error: a scene that was asked for does not play."""
        self.error(osc.address(self._prefix, osc.SCENE_LOAD), why)

    def hear_rolls(self, rolls: "Rolls") -> None:
        """Let rate and level of the roll be asked for from now on."""
        self._inbound.rolls = rolls

    def hear_scenes(self, scenes: "SceneRequests") -> None:
        """Let other scenes be asked for from now on."""
        self._inbound.scenes = scenes

    def roll(self, rate_Hz: float, level: float) -> None:
        """Send what roll the values in use lead to, to every target and to whoever asked for another lately."""
        p, now_s = self._prefix, self._now()
        for row, value in ((osc.ROLL_RATE, rate_Hz), (osc.ROLL_LEVEL, level)):
            claimed = self._reply_targets.claim(row.path, value, now_s)
            self._echo_filter.note_value(row.path, value, claimed, now_s)
            packet = osc.roll(p, row, value)
            self._packets_out.send([packet], [*self._targets.present(now_s), *claimed])

    def alive(self, rig: str, status: str, strikes: int) -> None:
        """Send /alive; once a second."""
        self._send_all(lambda: [osc.alive(self._prefix, rig, status, strikes)])

    def preset(self, name: str) -> None:
        """Send /preset: this one was loaded."""
        self._send_all(lambda: [osc.preset(self._prefix, name)])

    def lease(self, name: str, left_s: float) -> None:
        """Send /lease: who alone may set; "" when everybody may."""
        self._send_all(lambda: [osc.lease(self._prefix, name, left_s)])

    def error(self, address: str, why: str) -> None:
        """Send /error to every target."""
        self._send_all(lambda: [osc.error(self._prefix, address, why)])

    def close(self) -> None:
        """End the receive thread, which finishes what it has in hand, and close the socket. Idempotent."""
        if not self._closing.is_set():
            self._closing.set()
            self._wake.send(b"\0")
        self._thread.join()
        for each in (self._udp, self._wake, self._woken):
            each.close()
        self._refusals.log_line(self._now(), at_once=True)

    def receive(self, datagram: bytes, sender: Endpoint) -> None:
        """Act on one datagram: what the receive thread does with each. Only for that thread, and for tests."""
        self._inbound.receive(datagram, sender, self._now())

    def _found(self, target: Endpoint) -> None:
        if self._own.holds(target):
            _log.error("%s:%d is the rig's own OSC input: nothing is sent there", *target)
        else:
            self._targets.add(target)

    def _send_all(self, encoded: Callable[[], Sequence[bytes]], others: Sequence[Endpoint] = ()) -> None:
        now_s = self._now()
        try:
            packets = encoded()
        except ValueError as error:  # a number that is not finite must not reach an instrument
            self._refusals.refuse("unsendable", "the rig itself", str(error), now_s)
            return
        self._packets_out.send(packets, [*self._targets.present(now_s), *others])

    def _listen(self) -> None:
        poll = select.poll()
        poll.register(self._udp, select.POLLIN)
        poll.register(self._woken, select.POLLIN)
        while not self._closing.is_set():
            if poll.poll(_LOG_DUE_MS):
                self._drain()
            self._refusals.log_line(self._now())

    def _drain(self) -> None:
        for _ in range(_AT_ONCE):
            try:
                datagram, sender = self._udp.recvfrom(MAX_BYTES + 1)
            except BlockingIOError:
                return
            except OSError:  # an ICMP refusal of something sent earlier
                self._refusals.count("receive_failed")
                return
            self.receive(datagram, sender)
