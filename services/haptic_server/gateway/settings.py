"""The one place where sets of parameters are accepted or refused, whole, and where readbacks are known.

Any gateway thread; one short lock, never held over a call to the network.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes import table as parameters
from drumstick.scenes.drum_values import require_drum
from drumstick.scenes.table import Parameter, Refusal
from drumstick.stick.law import DRUM, Records
from haptic_server.gateway.lease import Lease, LeaseHolder
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.rounding import is_same
from haptic_server.permission import EVENTS, SCENE, SET
from protocol.keys import DEFAULT_RIG, command
from protocol.messages import SetReply
from protocol.requests import ANYBODY, Claim

_log = logging.getLogger("gateway")


class ReadbackValue(NamedTuple):
    """One value to tell the world: what the servo uses now."""

    name: str
    value: float
    norm: float


class Parameters:
    """Accepts sets through the joint envelope, offers them to the servo, and remembers what the servo really uses."""

    def __init__(
        self,
        scene: Scene,
        link: ServoLink,
        limits: envelope.Limits | None = None,
        now: Callable[[], float] = time.monotonic,
        rig: str = DEFAULT_RIG,
    ) -> None:
        """`limits`: what scene and device allow; the scene's own guard without them. `now`: s, for the lease."""
        self._arm = command("arm", rig)
        self.table: Mapping[str, Parameter] = parameters.table_of(scene)
        self._scene = scene
        self._limits = limits or envelope.Limits.of(scene)
        self._link = link
        self._now = now
        self._lease = Lease()
        self._lock = threading.Lock()
        self._live_revision, self._live = link.first_live()
        waiting = link.waiting()
        self._revision, self._accepted = waiting if waiting else (self._live_revision, self._live)
        self._touched: set[str] = set()
        # Loaded now, where the servo has compiled it: the first set must not wait for it.
        envelope.judge(self._live[0], self._limits.record()[0], envelope.new_scratch())

    def values(self) -> dict[str, float]:
        """Values that the servo uses, by wire name. z_h0 is NaN while the hand has no stiffness."""
        with self._lock:
            return parameters.values_of(self._live, self.table)

    def accepted_values(self) -> dict[str, float]:
        """Values that the servo will use once it has taken the newest accepted set."""
        with self._lock:
            return parameters.values_of(self._accepted, self.table)

    @property
    def live_revision(self) -> int:
        """Revision of the set that the servo uses."""
        return self._live_revision

    @property
    def revision(self) -> int:
        """Revision of the newest accepted set."""
        return self._revision

    @property
    def pending(self) -> bool:
        """True when an accepted set still waits for the stick to be above the head."""
        return self._live_revision < self._revision

    def take_lease(self, who: str, name: str, seconds: float) -> LeaseHolder:
        """Take, renew or (0 s) give back the right to be the only one who sets; raises Refusal."""
        with self._lock:
            return self._lease.take(who, name, seconds, self._now())

    def keep_lease(self, before: "Parameters") -> None:
        """Go on with the lock on tuning that another scene's parameters had; before anybody asks for it here."""
        self._lease = before._lease

    def lease_holder(self) -> LeaseHolder:
        """Holder of the lease."""
        with self._lock:
            return self._lease.holder(self._now())

    def require_quiet(self, claim: Claim) -> None:
        """Raise Refusal where no other scene may be started: beside another's lease, and held by panic or fault."""
        with self._lock:
            self._admit(SCENE, claim)

    def require_free(self, claim: Claim) -> None:
        """Raise Refusal beside another's lease: a set that is to come would be refused."""
        with self._lock:
            self._admit(SET, claim)

    @property
    def live_law(self) -> Records:
        """Law that the servo uses."""
        with self._lock:
            return self._live

    @property
    def max_force_N(self) -> float:  # noqa: N802
        """Largest force that device and scene allow, N."""
        return self._limits.max_force_N

    def _admit(self, event: int, claim: Claim) -> None:
        # What the table of permission says of this wish, as things stand.
        row = EVENTS[event]
        if not row.beside_lease:
            self._lease.require(claim.lease, self._now())
        if not row.while_held and self._link.is_held():
            raise Refusal(f"a panic or a fault is latched: type `{self._arm}` on the haptic machine first")

    def set(self, changes: Mapping[str, float], source: str, claim: Claim = ANYBODY) -> SetReply:
        """Accept all of `changes` or raise Refusal; the servo takes them when the stick is above the head.

        Changes build on the newest accepted set, so nothing accepted before is lost while it waits. Somebody else's
        lease refuses them, and so does a newer set than the one that the claim names. Values that the newest accepted
        set has already, to 32 bits, make no revision and no readback; the answer's `pending` is then whether they wait.
        `source` names who asked, for the log, e.g. "osc 127.0.0.1:50412".
        """
        if not changes:
            raise Refusal("an empty set: name at least one parameter")
        with self._lock:
            self._admit(SET, claim)
            if claim.revision not in (None, self._revision):
                raise Refusal(
                    f"set for revision {claim.revision}, but somebody made it {self._revision}: look again"
                )
            wanted = parameters.with_changes(self._accepted, self.table, changes)
            present = parameters.values_of(self._accepted, self.table)
            same = {name for name, value in changes.items() if is_same(value, present[name])}
            if len(same) == len(changes):
                return self._nothing_changes(present, changes)
            if same:  # what was only rounded on its way stays what it is to the last digit
                kept = {name: present[name] if name in same else value for name, value in changes.items()}
                wanted = parameters.with_changes(self._accepted, self.table, kept)
            if any(self.table[name].effect == DRUM for name in changes):
                require_drum(self._scene, parameters.values_of(wanted, self.table))
            envelope.require(wanted, self._limits)
            self._accepted = wanted
            self._revision += 1
            self._touched.update(changes)
            self._link.offer(self._revision, wanted)
            values = parameters.values_of(wanted, self.table)
            _log.debug("set %s by %s", dict(changes), source)
            return SetReply(
                values={name: values[name] for name in changes}, revision=self._revision, pending=True
            )

    def _nothing_changes(self, present: Mapping[str, float], names: Iterable[str]) -> SetReply:
        # No revision, and no readback beyond the one that a set before it may still wait for.
        live = parameters.values_of(self._live, self.table)
        pending = any(name in self._touched or live[name] != present[name] for name in names)
        revision = self._revision if pending else self._live_revision
        return SetReply(values={name: present[name] for name in names}, revision=revision, pending=pending)

    def panic(self, source: str) -> None:
        """Zero force, latched; only `drumstick arm` on this machine clears it."""
        with self._lock:
            is_news = not self._link.is_held()
            self._link.raise_panic()
        if is_news:  # a flood of panics is one panic in the log
            _log.warning("panic from %s; clear it with: %s", source, self._arm)

    def latched(self, revision: int, law: Records) -> list[ReadbackValue]:
        """The servo now uses `law`: what to echo (everything that was set, and whatever else changed with it)."""
        with self._lock:
            before = parameters.values_of(self._live, self.table)
            self._live_revision, self._live = revision, law
            after = parameters.values_of(law, self.table)
            names = [n for n in after if n in self._touched or after[n] != before[n]]
            if revision >= self._revision:
                self._touched.clear()
        return self._echoes({name: after[name] for name in names})

    def everything(self) -> tuple[list[ReadbackValue], int]:
        """All readbacks, and the revision that they are of."""
        with self._lock:
            values, revision = parameters.values_of(self._live, self.table), self._live_revision
        return self._echoes(values), revision

    def _echoes(self, values: Mapping[str, float]) -> list[ReadbackValue]:
        return [ReadbackValue(n, v, self.table[n].norm(v)) for n, v in values.items() if math.isfinite(v)]

    def refused_by_servo(self, revision: int) -> None:
        """The servo's own fence turned down a set: fall back to what it uses."""
        with self._lock:
            if revision >= self._revision:
                self._accepted, self._touched = self._live, set()
                self._revision += 1
                self._live_revision = self._revision
        _log.error(
            "the servo refused set %d, which the gateway had accepted; its parameters are unchanged", revision
        )

    def servo_restarted(self) -> None:
        """A new servo starts from the scene: give it the accepted set again."""
        with self._lock:
            self._live_revision, self._live = self._link.first_live()
            self._revision += 1
            self._touched.update(self.table)
            self._link.offer(self._revision, self._accepted)
