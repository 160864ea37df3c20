"""State of the rig as the panel knows it, with its age. Written and read by the main thread only."""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Parameter
from protocol.announced import Announcements
from protocol.messages import Cost, Membrane, Meter, Readback, Release, Spectrum, State, Strike

SILENT_AFTER_S = 1.0  # State comes 30 times a second
METER_LIFE_S = 3.0
_LIMITED_SHOWN_S = 5.0  # long enough to be read
_MOST = 1000  # names of any kind: whoever may publish could make up any number


@dataclass
class RigState:
    """The last of everything. Times are seconds of one monotonic clock."""

    connected: bool = False
    scene: Scene | None = None
    scenes_seen: int = 0
    scene_boot: int | None = None  # the start of the servo in which the scene was told last
    table: dict[str, Parameter] = field(default_factory=dict[str, Parameter])
    readbacks: dict[str, Readback] = field(default_factory=dict[str, Readback])
    # Accepted, but the servo takes them only when the stick is above the head.
    setpoints: dict[str, Readback] = field(default_factory=dict[str, Readback])
    limits: dict[str, float] = field(default_factory=dict[str, float])  # of the envelope; empty: not told
    state: State | None = None
    state_at: float = 0.0
    new_states: deque[tuple[float, State]] = field(
        default_factory=lambda: deque[tuple[float, State]](maxlen=64)
    )
    strike: Strike | None = None
    new_strikes: deque[tuple[float, Strike]] = field(
        default_factory=lambda: deque[tuple[float, Strike]](maxlen=256)
    )
    # Heard only while somebody looks (watching); None when it was not heard lately.
    new_releases: deque[tuple[float, Release]] = field(
        default_factory=lambda: deque[tuple[float, Release]](maxlen=256)
    )
    announcements: Announcements = field(default_factory=Announcements)
    membrane: Membrane | None = None
    spectrum: Spectrum | None = None
    costs: dict[str, Cost] = field(default_factory=dict[str, Cost])  # by accuracy
    doctor: dict[str, Any] | None = None
    present: set[str] = field(default_factory=set[str])  # service/id of every liveliness token
    presets: tuple[str, ...] = ()
    roll: dict[str, float] = field(
        default_factory=dict[str, float]
    )  # "rate" Hz, "level"; 0: none; not told: empty
    lease_of: str = ""  # who alone may set
    pointed: set[str] = field(default_factory=set[str])  # tokens of servos whose stick follows a pointer
    meters: dict[str, tuple[float, Meter]] = field(default_factory=dict[str, tuple[float, Meter]])
    limited_at: float = float("-inf")  # when a sound server's limiter was seen to bend the sound last

    def silent_s(self, now: float) -> float | None:
        """Seconds since the haptic server was heard; 0 while it is heard, None when it never was."""
        if self.state is None:
            return None
        silence = now - self.state_at
        return silence if silence > SILENT_AFTER_S else 0.0

    @property
    def z_h0_m(self) -> float:
        """Height at which the hand's spring is held; 0 until it is heard."""
        readback = self.readbacks.get("z_h0")
        return 0.0 if readback is None else readback.value

    def plays(self, now: float) -> bool:
        """True while the stick is heard to play: not at rest, in panic or fault, or silent."""
        return self.silent_s(now) == 0.0 and self.state is not None and self.state.status == "playing"

    def note_state(self, state: State, now: float) -> None:
        """Take a State; a strike of an earlier start of the servo is forgotten."""
        if self.state is not None and state.boot != self.state.boot:
            self.strike = None
        self.state, self.state_at = state, now
        self.new_states.append((now, state))

    def note_strike(self, strike: Strike, now: float) -> None:
        """Take a strike."""
        self.strike = strike
        self.new_strikes.append((now, strike))
        self.announcements.note_strike(strike)

    def note_release(self, release: Release, now: float) -> None:
        """Take a release."""
        self.new_releases.append((now, release))
        self.announcements.note_release(release)

    def forget_news(self) -> None:
        """Mark all news as seen."""
        self.new_states.clear()
        self.new_strikes.clear()
        self.new_releases.clear()

    def note_meter(self, meter: Meter, now: float) -> None:
        """Take a sound server's meter; those not heard lately are forgotten."""
        for gone in [name for name, (at, _) in self.meters.items() if now - at > METER_LIFE_S]:
            del self.meters[gone]
        if meter.id in self.meters and meter.limited_frames > self.meters[meter.id][1].limited_frames:
            self.limited_at = now
        if meter.id in self.meters or len(self.meters) < _MOST:
            self.meters[meter.id] = (now, meter)

    def note_scene(self, scene: Scene, table: dict[str, Parameter]) -> None:
        """Take the scene; `scenes_seen` grows when it is another one, and the old values go."""
        self.scene_boot = self.state.boot if self.state is not None else None
        if scene == self.scene:
            return
        self.scene, self.table = scene, table
        self.scenes_seen += 1
        self.readbacks.clear()
        self.setpoints.clear()

    def note_readback(self, name: str, readback: Readback) -> None:
        """Take a value, unless a newer one is known. Of one revision, the one that waits no more is the newer: an
        answer to a query and a publication can overtake each other."""
        known = self.readbacks.get(name)
        if known is None and len(self.readbacks) >= _MOST:
            return
        if known is None or (readback.revision, not readback.pending) >= (known.revision, not known.pending):
            self.readbacks[name] = readback
        waiting = self.setpoints.get(name)
        if waiting is not None and not readback.pending and readback.revision >= waiting.revision:
            del self.setpoints[name]

    def note_accepted(self, name: str, readback: Readback) -> None:
        """Take what the haptic server answered to a set: what it uses now, or what it will."""
        if not readback.pending:
            self.note_readback(name, readback)
            return
        known = self.readbacks.get(name)
        if known is None or known.pending or known.revision < readback.revision:
            self.setpoints[name] = readback

    def newest_revision(self) -> int:
        """Newest revision accepted, as far as this panel knows; -1 if none."""
        known = (*self.readbacks.values(), *self.setpoints.values())
        return max((readback.revision for readback in known), default=-1)

    def standing(self) -> dict[str, float]:
        """Newest accepted value of every parameter, as far as this panel knows."""
        return {name: (self.setpoints.get(name) or known).value for name, known in self.readbacks.items()}

    def living_meters(self, now: float) -> list[Meter]:
        """Meters of the sound servers heard lately, by id."""
        return [meter for _, (at, meter) in sorted(self.meters.items()) if now - at < METER_LIFE_S]

    def was_limited(self, now: float) -> bool:
        """True for some seconds after the limiter of a sound server that is heard bent its sound."""
        limits = any(meter.limited_frames for meter in self.living_meters(now))
        return limits and now - self.limited_at < _LIMITED_SHOWN_S
