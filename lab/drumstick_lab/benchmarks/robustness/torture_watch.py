"""Watch over a tortured rig's promises, from outside: strikes, values, panics, and that all comes back."""

import subprocess
import time

import msgspec
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, Listener, ask, wait_for

from drumstick_lab.benchmarks.robustness.torture_harm import SERVICES, Stage
from protocol.messages import Meter, Readback, SetReply, State, Strike, decode
from rig.network.ports import listens

ARM_EVERY_S = 3.0  # an arm that came too early is said again
# Of the scene `roll`, each well inside its envelope whatever the others are.
RANGES = {"dv_pls": (0.05, 0.25), "k_coll": (2000.0, 5000.0), "k_hand": (15.0, 30.0), "tau": (0.003, 0.006)}
_PARTS = ("panel", "strikes", "OSC", "sound", "services")
_STILL_STATES = 8  # of 30 a second


def _is_no_answer(reply: zenoh.Reply) -> bool:
    # Zenoh says for itself, in words, that time is over.
    return reply.ok is None and reply.err.payload.to_bytes() == b"Timeout"


class Broken(Exception):
    """A promise did not hold."""


class Watch:
    """Listens to one rig. `accepted`: every value that was answered ok, as it was answered."""

    def __init__(self, stage: Stage) -> None:
        rig, session = stage.rig, stage.session
        self._stage = stage
        self.states = Listener(session, rig.keys.state, State)
        self.strikes = Listener(session, rig.keys.strike, Strike)
        self._meters = Listener(session, rig.keys.meter, Meter)
        self._osc = OscPort(rig.osc_out, rig.osc_in)
        self.accepted: dict[str, float] = {}
        self.sets = self.refused = 0

    def close(self) -> None:
        self._osc.close()

    def osc_strikes(self) -> int:
        """Count of strikes heard by OSC since the last call."""
        return self._osc.count("/drumstick/strike")

    def forget(self) -> None:
        """Drop what was heard until now: memory shall not grow for hours."""
        for listener in (self.states, self.strikes, self._meters):
            del listener.got[:-1]
        self.osc_strikes()

    def lost(self) -> int:
        """Strikes that the servo made and nobody heard, between the first and the last heard one of each boot."""
        seqs: dict[int, list[int]] = {}
        for strike in list(self.strikes.got):
            seqs.setdefault(strike.boot, []).append(strike.seq)
        return sum(max(s) - min(s) + 1 - len(set(s)) for s in seqs.values())

    def set_some(self) -> None:
        """Ask for one new value; what is answered ok is to stay."""
        name = self._stage.chance.choice(list(RANGES))
        value = self._stage.chance.uniform(*RANGES[name])
        replies = list(
            self._stage.session.get(
                self._stage.rig.keys.set_many, payload=msgspec.msgpack.encode([1, {name: value}]), timeout=2.0
            )
        )
        if not replies or _is_no_answer(replies[0]):
            self.accepted.pop(name, None)  # it may be in force, now or later; nobody promised anything
            return
        if replies[0].ok is None:
            self.refused += 1
            return
        self.sets += 1
        self.accepted.update(decode(replies[0].ok.payload.to_bytes(), SetReply).values)

    def values(self) -> dict[str, float]:
        """Values of all parameters in RANGES, as the rig tells them now."""
        keys, session = self._stage.rig.keys, self._stage.session
        return {name: decode(ask(session, keys.param(name)), Readback).value for name in RANGES}

    def values_lost(self) -> list[str]:
        """Accepted values that are not there; these are taken as they are from now on.

        Not so a value whose set nobody has answered: it may still come into force.
        """
        found = self.values()
        lost = [
            f"{name}: accepted {value!r}, now {found[name]!r}"
            for name, value in self.accepted.items()
            if abs(found[name] - value) > 1e-6 * abs(value)
        ]
        self.accepted = {name: found[name] for name in self.accepted}
        return lost

    def status(self) -> str:
        """Status in the newest state; empty before there is one."""
        return self.states.got[-1].status if self.states.got else ""

    def panicked(self, since_s: float, within_s: float, repeated: bool) -> float:
        """Seconds from `since_s` until the state says panic, after one /panic or one every 20 ms.

        AssertionError when it does not within `within_s`.
        """
        self._osc.send("/drumstick/panic")

        def acts() -> bool:
            if repeated:
                self._osc.send("/drumstick/panic")
            return self.status() == "panic"

        wait_for("the panic", acts, since_s + within_s - time.monotonic())
        return time.monotonic() - since_s

    def assert_still(self) -> None:
        """Check that after a panic nothing is struck and nothing pushes, in the next states that are heard."""
        heard = len(self.states.got)
        first = self.states.got[-1]
        wait_for("states after the panic", lambda: len(self.states.got) > heard + _STILL_STATES)
        for state in self.states.got[heard:]:
            if state.boot == first.boot and state.strikes != first.strikes:
                raise Broken(f"{state.strikes - first.strikes} strikes after a panic")
            if state.force_N != 0.0:
                raise Broken(f"{state.force_N} N after a panic")

    def arm(self) -> None:
        """Arm at the haptic machine, as a player does."""
        subprocess.run([*DRUMSTICK, "arm", "--rig", self._stage.rig.name], check=False, timeout=60)

    def back(self, sounds: int) -> dict[str, float]:
        """Seconds until each part works again; Broken when one does not. A latched fault or panic is armed."""
        begun, heard = time.monotonic(), dict[str, float]()
        rig = self._stage.rig
        self.osc_strikes()
        begun_ns = time.monotonic_ns()  # the servo's clock: what was on its way before does not count
        played: dict[str, int] = {m.id: m.played for m in list(self._meters.got)}
        armed = 0.0

        def all_there() -> bool:
            nonlocal armed
            now = time.monotonic()
            if rig.process.poll() is not None:
                raise Broken(f"the rig ended with {rig.process.returncode}: {rig.lines[-3:]}")
            if self.status().startswith(("panic", "fault")) and now - armed > ARM_EVERY_S:
                armed = now
                self.arm()
            new = [m for m in list(self._meters.got) if m.played > played.setdefault(m.id, m.played)]
            there = (
                listens("127.0.0.1", rig.panel_port),
                bool(self.strikes.got) and self.strikes.got[-1].t_ns > begun_ns,
                self.osc_strikes() > 0 and "strikes" in heard,
                len({m.id for m in new}) >= sounds and "strikes" in heard,
                len(rig.children()) == len(SERVICES),
            )
            for name, is_there in zip(_PARTS, there, strict=True):
                if is_there:
                    heard.setdefault(name, time.monotonic() - begun)
            return len(heard) == len(_PARTS)

        try:
            wait_for("all parts", all_there)
        except AssertionError:
            raise Broken(f"not back: only {sorted(heard)}, {self.status()!r}") from None
        return heard
