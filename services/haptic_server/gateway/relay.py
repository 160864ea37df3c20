"""The relay: carries events, readbacks and status from the block to the wires. Its own thread; ordinary Python.

Compiled code waits for events, sets that the servo has taken and streamed force (event_wait); the rest is seen to when
the next state goes out, every 2 ms where something else may come that is only found by looking. An event goes out over
Zenoh first, which the sound server hears, then as one OSC message, then as that one's mirrors.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.played_strikes import MIDI, PlayedStrikes
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.settings import Parameters, ReadbackValue
from haptic_server.gateway.zenoh.contacts import Contacts
from haptic_server.gateway.zenoh.pointer_input import Pointing
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.presets.last_good import LastGood
from haptic_server.records import FAULT, FAULT_WORDS, NO_FAULT, STATUS_WORDS, STRIKE
from haptic_server.servo.priority import no_timer_slack
from protocol.messages import Release, State, Strike
from realtime.notify import Supervisor
from realtime.stop import StopRequest

if TYPE_CHECKING:
    from haptic_server.gateway.midi.sender import MidiSender
    from haptic_server.gateway.osc.osc_server import OscServer

_log = logging.getLogger("gateway")
_ROUND_NS = 2_000_000
_STATE_PERIOD_NS = 33_333_333
_ALIVE_PERIOD_NS = 1_000_000_000


class Wires(NamedTuple):
    """Publishers of a gateway; None: not asked for, or not in this scene."""

    zenoh: Wire
    osc: OscServer
    pointing: Pointing | None = None
    contacts: Contacts | None = None
    midi: MidiSender | None = None
    played: PlayedStrikes | None = None
    ahead: SceneAhead | None = None


class Relay:
    """Joins one servo's block to one Zenoh wire and one OSC server."""

    def __init__(
        self,
        rig: str,
        link: ServoLink,
        parameters: Parameters,
        wires: Wires,
        last_good: LastGood | None = None,
        supervisor: Supervisor | None = None,
        note_change: Callable[[], None] = lambda: None,
    ) -> None:
        """note_change: called when the servo uses other values."""
        self._rig = rig
        self._link = link
        self._parameters = parameters
        self._wire, self._osc, self._pointing, self._contacts, self._midi, self._played = wires[:6]
        self._ahead = wires.ahead
        self._is_over = False  # another scene plays
        self._is_in_contact = False  # by what went to the mirrors
        self._last_good = last_good
        self._supervisor = supervisor
        self._note_change = note_change
        self._lease_of = ""
        self._started_ns = 0
        self._next_state_ns = 0
        self._next_alive_ns = 0
        self._refused = 0
        self._published_pending = 0
        if self._played is not None:
            self._played.begin(self._put_played, self._put_release, self._wire.put_choke, link.wake)

    def run(self, stop: StopRequest) -> None:
        """Relay until `stop` is set, or another scene has taken the place of this one."""
        self._started_ns = time.monotonic_ns()
        if sys.platform.startswith("linux"):
            no_timer_slack()
        while not (stop.is_set() or self._is_over):
            now_ns = time.monotonic_ns()
            self.step(now_ns)
            if self._contacts is not None:
                self._link.force_cells = self._contacts.cells
            self._link.await_events(self.next_round_ns(now_ns))
        self._end_contacts()
        if self._played is not None:
            self._played.release_all()

    def _end_contacts(self) -> None:
        # A servo that ended within a contact left no release of it: the gate falls and the note ends without one.
        for event in self._link.take_events():  # the last ones of the servo that has ended
            self._publish_event(event)
        if self._is_in_contact:
            self._is_in_contact = False
            self._osc.end_gate()
            if self._midi is not None:
                self._midi.release()

    def next_round_ns(self, now_ns: int) -> int:
        """Time of the round after one at now_ns, if nothing comes before it; monotonic ns."""
        # Subscribers that come back, a pointer and who listens to the force are only found by looking.
        if self._wire.holds_back or self._link.is_pointed or self._contacts is not None:
            return now_ns + _ROUND_NS
        if self._played is None:
            return self._next_state_ns
        return min(self._next_state_ns, self._played.due_ns(self._next_state_ns))

    def step(self, now_ns: int) -> None:
        """One round: everything that waits in the block goes out."""
        for event in self._link.take_events():
            self._publish_event(event)
        self._wire.step(now_ns)
        if self._played is not None:
            self._played.step(now_ns)
        if self._contacts is not None:
            self._contacts.step(now_ns)
        latched = self._link.take_live()
        if latched is not None:
            self._echo(self._parameters.latched(*latched), pending=False)
            self._note_change()
            if self._last_good is not None:
                self._last_good.note(self._parameters.values(), now_ns)
        if self._pointing is not None:
            self._pointing.step(now_ns)
        if now_ns >= self._next_state_ns:
            self._next_state_ns = now_ns + _STATE_PERIOD_NS
            self._publish_state(now_ns)

    def _publish_event(self, event: Any) -> None:
        # A strike made while no gateway ran still reaches Zenoh, but not the OSC mirrors: a DAW would play it late.
        fresh = int(event["t_ns"]) >= self._started_ns
        if event["kind"] == STRIKE:
            strike = Strike(
                boot=self._link.boot,
                seq=int(event["seq"]),
                t_ns=int(event["t_ns"]),
                x=float(event["x"]),
                y=float(event["y"]),
                z_speed_m_per_s=float(event["speed_m_per_s"]),
                level=float(event["level"]),
                peak_estimate_N=float(event["peak_N"]),
                contact_estimate_s=float(event["contact_s"]),
                impulse_N_s=float(event["impulse_N_s"]),
            )
            self._wire.put_strike(strike)
            if fresh:
                self._is_in_contact = True
                self._mirror_strike(strike)
            return
        self._is_in_contact = False
        release = Release(
            boot=self._link.boot,
            seq=int(event["seq"]),
            t_ns=int(event["t_ns"]),
            exit_speed_m_per_s=float(event["speed_m_per_s"]),
            impulse_N_s=float(event["impulse_N_s"]),
            peak_N=float(event["peak_N"]),
            contact_s=float(event["contact_s"]),
        )
        self._put_release(release, fresh)

    def _put_release(self, release: Release, fresh: bool = True) -> None:
        self._wire.put_release(release)
        if fresh:
            self._osc.release(release)
            if self._midi is not None and release.source != MIDI:
                self._midi.release()

    def _put_played(self, strike: Strike) -> None:
        # On the thread of whoever plays it, so that it waits for no round.
        self._wire.put_played(strike)
        self._mirror_strike(strike)

    def _mirror_strike(self, strike: Strike) -> None:
        self._osc.strike(strike)
        if (
            self._midi is not None and strike.source != MIDI
        ):  # or a program that echoes notes would play for ever
            self._midi.strike(strike)

    def _echo(self, echoes: list[ReadbackValue], *, pending: bool) -> None:
        self._wire.put_readbacks(echoes, self._parameters.live_revision, pending)
        for echo in echoes:
            self._osc.readback(echo.name, echo.value, echo.norm)

    def _publish_state(self, now_ns: int) -> None:
        status = self._link.status()
        words = self._status_words(status)
        pending = self._parameters.pending
        self._wire.put_state(
            State(
                boot=self._link.boot,
                t_ns=int(status["t_ns"]),
                status=words,
                z_m=float(status["z_m"]),
                v_m_per_s=float(status["v_m_per_s"]),
                force_N=float(status["force_N"]),
                x=float(status["x"]),
                y=float(status["y"]),
                roll_rate_Hz=float(status["roll_rate_Hz"]),
                v_e_m_per_s=float(status["v_e_m_per_s"]),
                strikes=int(status["strikes"]),
                ticks=int(status["tick"]),
                overruns=int(status["overruns"]),
                lateness_p99_us=self._link.lateness_p99_us(),
                lateness_worst_us=int(status["lateness_worst_ns"]) / 1e3,
                ring_dropped=self._link.events_lost(),
                revision=self._parameters.live_revision,
                pending=pending,
                next_scene=self._ahead.name if self._ahead is not None else "",
                scene_refusal=self._ahead.refusal if self._ahead is not None else "",
            )
        )
        self._publish_pending(pending)
        self._publish_lease()
        if self._midi is not None:
            self._midi.status(words)
        if self._last_good is not None:
            self._last_good.fault(int(status["fault"]) if status["status"] == FAULT else NO_FAULT, now_ns)
        if int(status["refused"]) != self._refused:
            self._refused = int(status["refused"])
            self._parameters.refused_by_servo(int(status["refused_revision"]))
        if now_ns >= self._next_alive_ns:
            self._next_alive_ns = now_ns + _ALIVE_PERIOD_NS
            strikes = int(status["strikes"])
            self._osc.alive(self._rig, words, strikes)
            if self._supervisor is not None:
                self._supervisor.notify_alive(f"{words}; {strikes} strikes")
        self._find_new_servo(now_ns)

    def _publish_pending(self, pending: bool) -> None:
        # Once for each accepted set that is still waiting when a state goes out.
        if pending and self._parameters.revision != self._published_pending:
            self._published_pending = self._parameters.revision
            self._wire.put_readbacks(*self._parameters.everything(), pending=True)

    def _publish_lease(self) -> None:
        holder = self._parameters.lease_holder()
        if holder.name != self._lease_of:
            self._lease_of = holder.name
            self._wire.put_lease(holder)
            self._osc.lease(*holder)

    def _status_words(self, status: Any) -> str:
        if not self._link.servo_is_alive() and not self._link.servo_is_about_to_tick():
            return "fault: the servo process does not tick"
        if status["status"] == FAULT:
            return f"fault: {FAULT_WORDS.get(int(status['fault']), 'unknown')}"
        return STATUS_WORDS[int(status["status"])]

    def _find_new_servo(self, now_ns: int) -> None:
        if self._ahead is not None and (refusal := self._ahead.look()):
            self._osc.scene_refused(refusal)
        # Looked at once: a block that comes between two looks would be taken for one of this scene.
        if not self._link.is_replaced():
            return
        if self._ahead is not None and self._ahead.has_come():
            self._is_over = True
            return
        self._end_contacts()
        if self._link.refresh():
            self._refused = 0
            self._started_ns = now_ns  # what it played until now is late for a DAW
            self._parameters.servo_restarted()
            _log.info("a new servo is running")
