"""Handlers of incoming OSC messages: an exact dictionary of addresses, no patterns.

Everything here runs on the OSC receive thread. A mistake is answered with /error, to the sender and to every
target, and changes nothing; a flood of mistakes is counted, but answered only 20 times a second.
"""

import logging
import math
import secrets
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache, partial
from ipaddress import IPv4Network, IPv6Network, ip_address
from typing import TYPE_CHECKING

from drumstick.analysis.ramp import Leg
from drumstick.scenes.table import Parameter, Refusal
from haptic_server.gateway.lease import MAX_S
from haptic_server.gateway.osc.arguments import Refused, in_range, number, port, strike, text, way
from haptic_server.gateway.osc.outbound import Outbound
from haptic_server.gateway.osc.prescan import Message, Unreadable, prescan
from haptic_server.gateway.osc.reply_rate_limit import ReplyRateLimit
from haptic_server.gateway.osc.targets import SUBSCRIPTION_S, Endpoint
from haptic_server.gateway.played_strikes import NOBODY_PLAYS, Player
from haptic_server.gateway.rounding import is_norm_of, is_same
from haptic_server.gateway.settings import Parameters
from haptic_server.presets.preset import PresetError
from haptic_server.set_list import NEXT, PREVIOUS
from haptic_server.set_rate_limit import SETS_A_SECOND, SetRateLimit, Verdict
from protocol import osc
from protocol.requests import Claim

if TYPE_CHECKING:
    from haptic_server.gateway.rolls.rolls import Outcome, Rolls, Standing
    from haptic_server.gateway.scenes.requests import SceneRequests

Network = IPv4Network | IPv6Network

ERRORS_A_SECOND = (20, 200)  # of one sender, of all together
SYNCS_A_SECOND = (5, 20)  # a sync is many messages: it must not multiply a flood
PRESETS_A_SECOND = (5, 20)  # a preset is read from a file
SHARED_ASKS_A_SECOND = (100, 400)  # answers beyond these go to the sender only
_REMEMBERED_HOSTS = 1024

_log = logging.getLogger(__name__)


LoadPreset = Callable[[str, str, Claim], object]
_Action = Callable[[Sequence[osc.Argument], Endpoint, float], None]


def _named(sender: Endpoint) -> str:
    return f"osc {sender[0]}:{sender[1]}"


class Inbound:
    """Receiver of datagrams. `load_preset(name, source, claim)` raises PresetError or Refusal."""

    def __init__(
        self,
        prefix: str,
        parameters: Parameters,
        load_preset: LoadPreset,
        allow: Sequence[Network],
        outbound: Outbound,
        player: Player = NOBODY_PLAYS,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._prefix = prefix
        self._now = now
        self._secret = secrets.token_hex(8)  # a sender's lease is its address here, and nobody's elsewhere
        self._own, self._packets_out, self._targets = outbound.own, outbound.packets_out, outbound.targets
        self._reply_targets, self._echo_filter = outbound.reply_targets, outbound.echo_filter
        self._refusals = outbound.refusals
        self._set_rates = SetRateLimit()
        self._received_own = False
        self._errors = ReplyRateLimit(*ERRORS_A_SECOND)
        self._syncs = ReplyRateLimit(*SYNCS_A_SECOND)
        self._loads = ReplyRateLimit(*PRESETS_A_SECOND)
        self._tracebacks = ReplyRateLimit(1, 1)
        self._shared_asks = ReplyRateLimit(*SHARED_ASKS_A_SECOND)
        self._late_errors = ReplyRateLimit(*ERRORS_A_SECOND)
        self.rolls: Rolls | None = None
        self.scenes: SceneRequests | None = None

        @lru_cache(_REMEMBERED_HOSTS)
        def allowed(host: str) -> bool:
            return any(ip_address(host) in network for network in allow)

        self._allowed = allowed
        self.insiders: set[Endpoint] = set()
        # Two rigs that send to each other must not answer each other's errors for ever.
        self._never_answered = {osc.address(prefix, row) for row in (osc.ERROR, osc.PONG)}
        self._changing = threading.Lock()  # between two datagrams
        self.play_scene(parameters, load_preset, player)

    def play_scene(self, parameters: Parameters, load_preset: LoadPreset, player: Player) -> None:
        """Hear the addresses of this scene from the next datagram on. Any thread."""
        with self._changing:
            self._parameters, self._load_preset, self._player = parameters, load_preset, player
            self.rolls = self.scenes = None
            self._actions = self._actions_of(parameters)

    def _actions_of(self, parameters: Parameters) -> dict[str, _Action]:
        prefix = self._prefix
        actions: dict[str, _Action] = {
            osc.address(prefix, osc.SYNC): self._sync,
            osc.address(prefix, osc.PING): self._ping,
            osc.address(prefix, osc.SUBSCRIBE): self._subscribe,
            osc.address(prefix, osc.UNSUBSCRIBE): self._unsubscribe,
            osc.address(prefix, osc.PRESET_LOAD): self._preset_load,
            osc.address(prefix, osc.SCENE_LOAD): self._scene_load,
            osc.address(prefix, osc.SCENE_NEXT): partial(self._scene_step, NEXT),
            osc.address(prefix, osc.SCENE_PREVIOUS): partial(self._scene_step, PREVIOUS),
            osc.address(prefix, osc.TAKE_LEASE): self._take_lease,
            osc.address(prefix, osc.PLAY_STRIKE): self._play_strike,
            osc.address(prefix, osc.PLAY_CHOKE): self._play_choke,
            osc.address(prefix, osc.PLAY_RATE): partial(self._play_roll, osc.PLAY_RATE),
            osc.address(prefix, osc.PLAY_LEVEL): partial(self._play_roll, osc.PLAY_LEVEL),
            osc.address(prefix, osc.PANIC): self._panic,
        }
        for name, row in parameters.table.items():
            actions[osc.address(prefix, osc.SET, name)] = partial(self._param, row)
            actions[osc.address(prefix, osc.SET_NORM, name)] = partial(self._param_norm, row)
        return actions

    @property
    def addresses(self) -> frozenset[str]:
        """Every address that is heard."""
        return frozenset(self._actions)

    def receive(self, datagram: bytes, sender: Endpoint, now_s: float) -> None:
        """Act on one datagram, or refuse it. Never raises."""
        if self._own.holds(sender):
            self._note_own()
            return
        if not self._allowed(sender[0]) and sender not in self.insiders:
            self._refusals.refuse("source", sender[0], "this source is not allowed", now_s)
            return
        message = prescan(datagram)
        if isinstance(message, Unreadable):
            self._refuse("unreadable", message.address, message.why, sender, now_s)
            return
        with self._changing:
            self._act(message, sender, now_s)

    def _act(self, message: Message, sender: Endpoint, now_s: float) -> None:
        action = self._actions.get(message.address)
        if action is None:
            self._refuse("address", message.address, "no such address", sender, now_s)
            return
        try:
            action(message.args, sender, now_s)
        except Refused as refused:
            self._refuse(refused.reason, message.address, str(refused), sender, now_s)
        except (Refusal, PresetError) as refusal:
            self._refuse("value", message.address, str(refusal), sender, now_s)
        except Exception:  # noqa: BLE001  a fault of ours in one message must not deafen the rig to /panic
            self._refuse("fault", message.address, "a fault of the rig: see its log", sender, now_s)
            if self._tracebacks.spend("any", now_s):
                _log.exception("osc: a fault in %s", message.address)
        else:
            self._refusals.count("served")

    def _note_own(self) -> None:
        self._refusals.count("own")
        if not self._received_own:  # once: it comes back with every message that goes out
            self._received_own = True
            _log.warning(
                "osc: what the rig sends comes back to its own port, and is dropped: look at the targets"
            )

    def _refuse(self, reason: str, address: str, why: str, sender: Endpoint, now_s: float) -> None:
        # Count, tell, and answer unless the sender has had its answers of this second.
        if not why:
            self._refusals.count(reason)
            return
        self._refusals.refuse(reason, sender[0], f"{address}: {why}", now_s)
        if address in self._never_answered or not self._errors.spend(sender, now_s):
            return
        self._packets_out.send([osc.error(self._prefix, address, why)], self._with_targets(sender, now_s))

    def _with_targets(self, sender: Endpoint, now_s: float) -> Iterable[Endpoint]:
        return [sender, *self._targets.present(now_s)]

    def _both_forms(self, row: Parameter, value: float) -> list[bytes]:
        if not math.isfinite(value):
            raise Refused("value", f"{row.name} has no value at present")
        norm = row.norm(value)
        return [osc.param(self._prefix, row.name, value), osc.param_norm(self._prefix, row.name, norm)]

    def _param(self, row: Parameter, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        if not args:
            self._answer(row, sender, now_s)
            return
        self._require_calm(sender, now_s)
        value = in_range(row, number(args))
        is_it = partial(is_same, value)
        present = self._parameters.accepted_values()[row.name]
        if is_it(present) or not self._is_echo(row, is_it, present, sender, now_s):
            self._set(row, value, sender, now_s)

    def _param_norm(
        self, row: Parameter, args: Sequence[osc.Argument], sender: Endpoint, now_s: float
    ) -> None:
        if not args:
            self._answer(row, sender, now_s)
            return
        self._require_calm(sender, now_s)
        norm = number(args)
        if not 0.0 <= norm <= 1.0:
            raise Refused("value", f"{norm:g} is outside 0 .. 1")
        present = self._parameters.accepted_values()[row.name]
        is_it = partial(is_norm_of, row, norm)
        if math.isfinite(present) and is_it(present):
            self._set(row, present, sender, now_s)
        elif not self._is_echo(row, is_it, present, sender, now_s):
            self._set(row, row.from_norm(norm), sender, now_s)

    def _is_echo(
        self, row: Parameter, is_it: Callable[[float], bool], present: float, sender: Endpoint, now_s: float
    ) -> bool:
        # A fader that moves meets where it was, coming back from a rig or a surface that sends back what it hears.
        if not self._echo_filter.is_echo(row.name, is_it, sender, now_s):
            return False
        self._refusals.count("echo")
        if math.isfinite(present) and self._echo_filter.spend(row.name, present, sender, now_s):
            self._packets_out.send(self._both_forms(row, present), [sender])
        return True

    def _require_calm(self, sender: Endpoint, now_s: float) -> None:
        # One error, and then silence: whoever floods the rig with sets would get a flood of answers, and answer them.
        verdict = self._set_rates.judge(sender, now_s)
        if verdict is Verdict.HELD_FIRST:
            why = f"more than {SETS_A_SECOND:g} sets a second: a loop? None is taken from you until there are fewer"
            raise Refused("held_back", why)
        if verdict is Verdict.HELD:
            raise Refused("held_back", "")

    def _answer(self, row: Parameter, sender: Endpoint, now_s: float) -> None:
        value = self._parameters.values()[row.name]
        packets = self._both_forms(row, value)
        targets = self._targets.present(now_s) if self._shared_asks.spend(sender, now_s) else []
        self._note_published(row.name, value, targets, sender, now_s)
        self._packets_out.send(packets, [sender, *targets])

    def _note_published(
        self, name: str, value: float, targets: Iterable[Endpoint], sender: Endpoint, now_s: float
    ) -> None:
        self._echo_filter.note(name, value, [target for target in targets if target != sender], now_s)

    def _set(self, row: Parameter, value: float, sender: Endpoint, now_s: float) -> None:
        before = self._reply_targets.expect(row.name, sender, value, now_s)
        try:
            reply = self._parameters.set({row.name: value}, _named(sender), self._claim(sender))
        except Refusal:
            self._reply_targets.forget(row.name, sender, before)
            raise
        if not reply.pending:
            # Nothing changes, so no readback will come. The sender alone is answered.
            self._reply_targets.forget(row.name, sender)
            accepted = reply.values[row.name]
            if self._echo_filter.spend(row.name, accepted, sender, now_s):
                self._packets_out.send(self._both_forms(row, accepted), [sender])

    def _sync(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        # Buttons of touch screens send a number with every message: it means nothing here.
        if not self._syncs.spend(sender, now_s):
            raise Refused("too_often", f"asked more than {SYNCS_A_SECOND[0]} times in a second")
        values = self._parameters.values()
        targets = self._targets.present(now_s)
        endpoints = [sender, *targets]
        for name, row in self._parameters.table.items():
            if math.isfinite(values[name]):
                self._note_published(name, values[name], targets, sender, now_s)
                self._packets_out.send(self._both_forms(row, values[name]), endpoints)
            else:
                refused = osc.address(self._prefix, osc.SET, name)
                why = f"{name} has no value at present"
                self._packets_out.send([osc.error(self._prefix, refused, why)], endpoints)

    def _ping(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        try:
            pong = osc.pong(self._prefix, args)
        except ValueError as error:
            raise Refused("value", str(error)) from None
        self._packets_out.send([pong], [sender])

    def _subscribe(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        self._require_own_address(sender)
        endpoint = (sender[0], port(args))
        if self._own.holds(endpoint):
            raise Refused("arguments", "that is the rig's own port")
        if full := self._targets.subscribe(endpoint, now_s):
            raise Refused("subscription", f"{full}: end one, or wait {SUBSCRIPTION_S:g} s for one to expire")

    def _unsubscribe(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        self._require_own_address(sender)
        self._targets.unsubscribe(sender[0], port(args) if args else None)

    def _require_own_address(self, sender: Endpoint) -> None:
        if sender in self.insiders:  # its address is ours, and so would be whose subscriptions it changes
            raise Refused("subscription", "over OSCQuery: LISTEN to addresses instead")

    def _claim(self, sender: Endpoint) -> Claim:
        return Claim(lease=f"{self._secret} {_named(sender)}")

    def _preset_load(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        name = text(args)
        if not self._loads.spend(sender, now_s):
            raise Refused("too_often", f"more than {PRESETS_A_SECOND[0]} presets in a second")
        self._load_preset(name, _named(sender), self._claim(sender))

    def _scene_load(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        self._ask_for_scene(text(args), sender, now_s)

    def _scene_step(self, way: str, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        if not args or number(args) != 0.0:  # a button that is let go sends 0
            self._ask_for_scene(way, sender, now_s)

    def _ask_for_scene(self, name: str, sender: Endpoint, now_s: float) -> None:
        if self.scenes is None:
            raise Refusal("no rig plays scenes here")
        if not self._loads.spend(sender, now_s):
            raise Refused("too_often", f"more than {PRESETS_A_SECOND[0]} presets or scenes in a second")
        self.scenes.ask_for(name, self._claim(sender))

    def _take_lease(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        name = text(args)
        seconds = MAX_S if name else 0.0
        holder = self._parameters.take_lease(self._claim(sender).lease, name or _named(sender), seconds)
        self._packets_out.send([osc.lease(self._prefix, *holder)], [sender])

    def _play_strike(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        self._player.play(*strike(args), _named(sender))

    def _play_choke(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        if not args or number(args) != 0.0:  # a button that is let go sends 0
            self._player.choke(_named(sender))

    def _play_roll(
        self, row: osc.Incoming, args: Sequence[osc.Argument], sender: Endpoint, now_s: float
    ) -> None:
        # One thread finds the roll: what becomes of it is told there.
        if self.rolls is None:
            raise Refusal("no rig rolls here")
        name = row.path.rpartition("/")[2]
        if not args:
            self.rolls.tell(partial(self._answer_roll, name, sender))
            return
        self._require_calm(sender, now_s)
        value, seconds = way(args)
        if not max(abs(value), abs(seconds)) <= osc.MAX_FLOAT:
            raise Refused("value", f"{value:g} in {seconds:g} s: send finite 32-bit numbers")
        is_it, known = partial(is_same, value), self.rolls.standing
        holds = known is not None and is_it(known.rate_Hz if name == "rate" else known.level)
        if not holds and self._echo_filter.is_echo(row.path, is_it, sender, now_s):
            self._refusals.count("echo")
            return
        self._reply_targets.expect(row.path, sender, value, now_s)
        answer = partial(self._answer_request, row, sender)
        try:
            self.rolls.request({name: Leg(value, seconds)}, _named(sender), self._claim(sender), answer)
        except Refusal:
            self._reply_targets.forget(row.path, sender)
            raise

    def _answer_roll(self, name: str, sender: Endpoint, standing: "Standing") -> None:
        row, value = (osc.ROLL_RATE, standing.rate_Hz) if name == "rate" else (osc.ROLL_LEVEL, standing.level)
        self._packets_out.send([osc.roll(self._prefix, row, value)], [sender])

    def _answer_request(self, row: osc.Incoming, sender: Endpoint, outcome: "Outcome") -> None:
        # On the thread of the rolls. A set that changes something is answered by its readback. One that was superseded
        # was mostly by its own sender, who waits for what came of the newer one.
        if outcome.superseded:
            return
        where, now_s = osc.address(self._prefix, row), self._now()
        if outcome.refusal:
            self._reply_targets.forget(row.path, sender)
            self._refusals.refuse("value", sender[0], f"{where}: {outcome.refusal}", now_s)
            if self._late_errors.spend(sender, now_s):
                error = osc.error(self._prefix, where, outcome.refusal)
                self._packets_out.send([error], self._with_targets(sender, now_s))
        elif outcome.reply is not None and not outcome.reply.pending and self.rolls is not None:
            self.rolls.tell(partial(self._answer_roll, row.path.rpartition("/")[2], sender))

    def _panic(self, args: Sequence[osc.Argument], sender: Endpoint, now_s: float) -> None:
        # Whatever comes with it: zero force is never refused.
        self._parameters.panic(_named(sender))
