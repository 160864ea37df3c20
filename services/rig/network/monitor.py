"""`drumstick monitor`: how a rig plays, a line a second: state, roll, and whether strikes announce the contacts."""

import json
import time
from typing import Any

from protocol.announced import Announcements, Report, sentence
from protocol.foreign_text import shown
from protocol.messages import Message, Meter, Release, State, Strike, decode
from rig.network.remote import opened
from rig.network.remote_rig import RemoteRig

_EVERY_S = 1.0
_SILENT_AFTER_S = 2.0
_RING = 1024
_MAX_METERS = 100  # whoever may publish could make up any number


class Monitor:
    """State of a rig from its messages. `note_...` and `line` on one thread; times are seconds of one clock that
    only grows.
    """

    def __init__(self) -> None:
        self._announcements = Announcements()
        self._state: State | None = None
        self._state_at = float("-inf")
        self._meters: dict[str, tuple[float, Meter]] = {}
        self._bad = 0

    def note(self, payload: bytes, kind: type[Message], now: float) -> None:
        """Take a message; what is none is counted."""
        try:
            message = decode(payload, kind)
        except ValueError:
            self._bad += 1
            return
        match message:
            case Strike():
                self._announcements.note_strike(message)
            case Release():
                self._announcements.note_release(message)
            case State():
                self._state, self._state_at = message, now
            case Meter():
                self._meters = {
                    name: entry for name, entry in self._meters.items() if _is_fresh(entry[0], now)
                }
                if message.id in self._meters or len(self._meters) < _MAX_METERS:
                    self._meters[message.id] = now, message
            case _:
                raise TypeError(kind)

    def line(self, now: float, as_json: bool) -> str:
        """Present state in one line."""
        state = self._state if _is_fresh(self._state_at, now) else None
        meters = [meter for at, meter in self._meters.values() if _is_fresh(at, now)]
        report = self._announcements.report()
        if as_json:
            return json.dumps(_object(state, meters, report, self._bad))
        words = [_stick(state), *(_sound(meter) for meter in meters), sentence(report)]
        if self._bad:
            words.append(f"Messages that could not be read: {self._bad}.")
        return " ".join(words)


def _is_fresh(at: float, now: float) -> bool:
    return now - at < _SILENT_AFTER_S


def _stick(state: State | None) -> str:
    if state is None:
        return "No data from the force loop."
    rate = f", {state.roll_rate_Hz:.1f} Hz" if state.roll_rate_Hz > 0.0 else ""
    return f"{shown(state.status)}, {state.strikes} strikes{rate}, {state.overruns} ticks missed."


def _sound(meter: Meter) -> str:
    lost = f"{meter.late} too late, {meter.underflows} gaps"
    loud = f"{meter.limited_frames} frames limited, {meter.clipped_frames} clipped"
    waiting = f" Not yet heard: {shown(meter.waiting)}." if meter.waiting else ""
    return (
        f"Sound ({shown(meter.sink)}): {meter.played} played, {lost}, {meter.xruns} xruns, {loud}.{waiting}"
    )


def _object(state: State | None, meters: list[Meter], report: Report | None, bad: int) -> dict[str, Any]:
    announced = None
    if report is not None:
        announced = {
            "contacts": report.contacts,
            "peak_median_dB": report.peak.median_dB,
            "peak_worst_dB": report.peak.worst_dB,
            "impulse_median_dB": report.impulse.median_dB,
            "impulse_worst_dB": report.impulse.worst_dB,
            "good": report.is_good,
        }
    return {
        "state": None if state is None else state.status,
        "strikes": None if state is None else state.strikes,
        "roll_rate_Hz": None if state is None else state.roll_rate_Hz,
        "ticks_missed": None if state is None else state.overruns,
        "sound": [
            {
                "id": m.id,
                "played": m.played,
                "late": m.late,
                "gaps": m.underflows,
                "xruns": m.xruns,
                "output_peak": m.output_peak,
                "output_rms": m.output_rms,
                "limited_frames": m.limited_frames,
                "clipped_frames": m.clipped_frames,
                "waiting": m.waiting,
            }
            for m in meters
        ],
        "announced": announced,
        "unreadable": bad,
    }


def monitor(end: RemoteRig, as_json: bool, duration_s: float | None) -> None:
    """Print a line a second until Ctrl-C or for `duration_s`. Raises CommandError where no router answers."""
    import zenoh

    begun = time.monotonic()
    found = Monitor()
    with opened(end) as session:
        keys = end.keys
        kinds = {keys.strike: Strike, keys.release: Release, keys.state: State, keys.meter: Meter}
        heard = [
            (session.declare_subscriber(key, zenoh.handlers.RingChannel(_RING)), kind)
            for key, kind in kinds.items()
        ]
        while duration_s is None or time.monotonic() < begun + duration_s:
            time.sleep(_EVERY_S)
            now = time.monotonic()
            for subscriber, kind in heard:
                while (sample := subscriber.try_recv()) is not None:
                    found.note(sample.payload.to_bytes(), kind, now)
            print(found.line(now, as_json), flush=True)
