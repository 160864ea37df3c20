"""State and meter of a soaking rig: one Zenoh session, its callbacks keep the newest."""

from typing import Any

from protocol.keys import Keys
from protocol.messages import Message, Meter, State, decode
from protocol.session import open_client
from realtime.stop import StopRequest

LATENESS, WORST = "lateness_p99_us", "lateness_worst_us"
ARRIVAL, JITTER, LOAD = "arrival_ms", "jitter_ms", "load"
LEVELS = (LATENESS, WORST, ARRIVAL, JITTER, LOAD)


class Hearing:
    """Any thread. Values are of the newest message; `faults` counts states that were neither ready nor playing."""

    def __init__(self, endpoint: str, rig: str) -> None:
        self._endpoint, self._keys = endpoint, Keys(rig)
        self._session: Any = None
        self.state: State | None = None
        self.meter: Meter | None = None
        self.faults = 0
        self.fault_words = ""
        self.unreadable = 0
        self.boots: set[int] = set()
        self.sounds: set[str] = set()

    def open(self, stop: StopRequest) -> bool:
        """Connect; False when `stop` came first."""
        self._session = open_client(self._endpoint, lambda: not stop.is_set())
        if self._session is None:
            return False
        for key, kind, take in (
            (self._keys.state, State, self._take_state),
            (self._keys.meter, Meter, self._take_meter),
        ):
            self._session.declare_subscriber(key, self._reader(kind, take))
        return True

    def _reader(self, kind: type[Message], take: Any) -> Any:
        def read(sample: Any) -> None:
            try:
                take(decode(sample.payload.to_bytes(), kind))
            except ValueError:
                self.unreadable += 1

        return read

    def _take_state(self, state: State) -> None:
        self.state = state
        self.boots.add(state.boot)
        if state.status not in ("ready", "playing"):
            self.faults += 1
            self.fault_words = state.status

    def _take_meter(self, meter: Meter) -> None:
        self.meter = meter
        self.sounds.add(meter.id)

    def levels(self) -> dict[str, float]:
        """Quantities to watch over time; nothing before both have spoken."""
        if self.state is None or self.meter is None:
            return {}
        return {
            name: float(getattr(self.state if hasattr(self.state, name) else self.meter, name))
            for name in LEVELS
        }

    def close(self) -> None:
        """End the session."""
        if self._session is not None:
            self._session.close()
