"""Strikes of a recording for the offline renderer: as the live sound server plays them, without a network's delay.

Strikes go by their estimates of peak and contact time; in a scene that streams, the stick's go by their recorded
forces.
What was set in the drum meanwhile is set again, and where a player choked it, it is choked.
The first of them falls 0.05 s into the sound. Each strike and each tick is played once, and what no stick can do is
left out and told, as it is live.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import LiveChange
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Refusal, table_of
from drumstick.stick.law import DRUM
from protocol.messages import STICK, Contact, Readback, Strike, decode
from rig.exit_status import usage_error
from rig.recording import channels
from rig.recording.reading import RecordedMessage, Recording, RecordingError, read
from sound_server.receiving.contacts import checked_forces
from sound_server.receiving.strikes import check, stroke_of

if TYPE_CHECKING:
    from collections.abc import Callable

_FIRST_S = 0.05
_RING_S = 1.0  # what is heard of the last one


class Played(NamedTuple):
    """Strikes and contacts, how long they sound, what is set in the drum meanwhile, and when it is choked, s."""

    blows: list[OfflineStrike]
    presses: list[StreamedContact]
    length_s: float
    changes: list[LiveChange]
    chokes: list[float]


class _Piece(NamedTuple):
    contact: Contact
    forces_N: npt.NDArray[np.float32]
    publish_ns: int


def played(path: Path, scene: Scene) -> Played:
    """Strikes and contacts for this scene's drum.

    Stop with what is wrong with the recording, or with the two together.
    """
    try:
        recording = read(path, (channels.STRIKE, channels.CHOKE, channels.CONTACT, channels.PARAM))
    except RecordingError as error:
        usage_error(str(error))
    if recording.torn:
        print(f"render: {path} {recording.torn}; it is played as far as it goes", file=sys.stderr)
    if scene.drum.excitation == "streamed":
        return _by_forces(recording, scene)
    return _by_strikes(recording, scene)


def _struck(
    recording: Recording, scene: Scene, is_wanted: "Callable[[Strike], bool]"
) -> list[tuple[RecordedMessage, Strike, float]]:
    # Each strike that is wanted, with its stroke.
    seen: set[tuple[int, int]] = set()
    strikes: list[tuple[RecordedMessage, Strike, float]] = []
    refused = 0
    for event in recording.of(channels.STRIKE):
        strike = decode(event.payload, Strike)
        if (strike.boot, strike.seq) in seen or not is_wanted(strike):
            continue
        seen.add((strike.boot, strike.seq))
        try:
            check(strike)
            stroke_m_per_s = stroke_of(strike, scene)
        except ValueError:
            refused += 1
        else:
            strikes.append((event, strike, stroke_m_per_s))
    _report_refused(recording, refused, "strikes")
    return strikes


def _blows(strikes: list[tuple[RecordedMessage, Strike, float]], first_ns: int) -> list[OfflineStrike]:
    return [
        OfflineStrike(
            _since(first_ns, event),
            s.x,
            s.y,
            s.peak_estimate_N,
            s.contact_estimate_s,
            s.impulse_N_s,
            stroke_m_per_s,
        )
        for event, s, stroke_m_per_s in strikes
    ]


def _by_strikes(recording: Recording, scene: Scene) -> Played:
    strikes = _struck(recording, scene, lambda _: True)
    if not strikes:
        usage_error(f"{recording.path}: no strikes in it")
    first_ns = strikes[0][0].publish_ns
    blows = _blows(strikes, first_ns)
    length_s = blows[-1].t_s + _RING_S
    return Played(blows, [], length_s, _changes(recording, scene, first_ns), _chokes(recording, first_ns))


def _by_forces(recording: Recording, scene: Scene) -> Played:
    pieces: list[_Piece] = []
    refused = 0
    for event in recording.of(channels.CONTACT):
        contact = decode(event.payload, Contact)
        try:
            pieces.append(_Piece(contact, checked_forces(contact), event.publish_ns))
        except ValueError:
            refused += 1
    _report_refused(recording, refused, "pieces of contacts")
    if not pieces:
        usage_error(
            f"{recording.path}: the scene {scene.name!r} plays the force itself, and none was recorded: record with"
            ' --force, or render with a scene whose [drum] has excitation = "analytic"'
        )
    rates = {piece.contact.rate_Hz for piece in pieces}
    if len(rates) > 1:
        listed = ", ".join(f"{rate:g}" for rate in sorted(rates))
        usage_error(
            f"{recording.path}: its forces have several rates, {listed} Hz: cut it where the servo's rate changes"
        )
    places = {
        (s.boot, s.seq): (s.x, s.y)
        for s in (decode(e.payload, Strike) for e in recording.of(channels.STRIKE))
    }
    strikes = _struck(recording, scene, lambda strike: strike.source != STICK)  # played: they have no forces
    first_ns = min([piece.publish_ns for piece in pieces] + [event.publish_ns for event, *_ in strikes])
    presses = list(_presses(pieces, first_ns, lambda boot, seq: places.get((boot, seq), (0.0, 0.0))))
    blows = _blows(strikes, first_ns)
    last_s = max(press.first_tick + len(press.forces_N) for press in presses) / rates.pop()
    length_s = max([last_s, *(blow.t_s for blow in blows)]) + _RING_S
    changes, chokes = _changes(recording, scene, first_ns), _chokes(recording, first_ns)
    return Played(blows, presses, length_s, changes, chokes)


def _presses(
    pieces: Iterable[_Piece], first_ns: int, place: "Callable[[int, int], tuple[float, float]]"
) -> Iterable[StreamedContact]:
    # Each contact on the grid of ticks, its pieces at their own ticks; a tick that came twice counts once.
    found = sorted(pieces, key=lambda piece: piece.publish_ns)
    begun: dict[tuple[int, int], tuple[int, int]] = {}
    done: set[tuple[int, int, int]] = set()
    for contact, forces, publish_ns in found:
        key = (contact.boot, contact.seq)
        at_tick = round(((publish_ns - first_ns) * 1e-9 + _FIRST_S) * contact.rate_Hz)
        begins = key not in begun
        start, first_tick = begun.setdefault(key, (at_tick, contact.first_tick))
        x, y = (contact.x, contact.y) if contact.x is not None and contact.y is not None else place(*key)
        ticks = [(*key, contact.first_tick + k) for k in range(len(forces))]
        new = np.array([tick not in done for tick in ticks])
        done.update(ticks)
        if not new.any():
            continue
        kept = np.where(new, forces, np.float32(0.0)).astype(np.float64)
        tick = max(start + contact.first_tick - first_tick, 0)
        yield StreamedContact(tick, contact.rate_Hz, x, y, kept, begins)


def _changes(recording: Recording, scene: Scene, first_ns: int) -> list[LiveChange]:
    # Of the values that this drum has; what held before the first blow holds from the beginning.
    rows = {name: row for name, row in table_of(scene).items() if row.effect == DRUM}
    # What one set changed comes parameter by parameter, and holds together: both coordinates of a pickup, say. Another
    # servo begins with the same revision and may have other values.
    found: list[LiveChange] = []
    refused = 0
    revision, at_s, together = None, 0.0, dict[str, float]()
    for event in recording.of(channels.PARAM):
        if event.name not in rows:
            continue
        readback = decode(event.payload, Readback)
        try:
            value = rows[event.name].check(readback.value)
        except Refusal:
            refused += 1
            continue
        if readback.revision != revision or together.get(event.name, value) != value:
            revision, at_s, together = readback.revision, max(_since(first_ns, event), 0.0), {}
        together[event.name] = value
        found.append(LiveChange(at_s, event.name, value))
    _report_refused(recording, refused, "settings of the drum", "that are out of range")
    return found


def _chokes(recording: Recording, first_ns: int) -> list[float]:
    # Before the first blow there is nothing to choke.
    return [_since(first_ns, event) for event in recording.of(channels.CHOKE) if event.publish_ns >= first_ns]


def _since(first_ns: int, event: RecordedMessage) -> float:
    return (event.publish_ns - first_ns) * 1e-9 + _FIRST_S


def _report_refused(recording: Recording, count: int, what: str, why: str = "that no stick can make") -> None:
    if count:
        print(f"render: {recording.path}: {count} {what} left out {why}", file=sys.stderr)
