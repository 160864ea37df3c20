"""`drumstick rigs`: every rig on the network, once or for as long as one watches."""

import json
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from protocol.foreign_text import shown as foreign
from rig.network.remote import opened
from rig.network.remote_rig import RemoteRig

if TYPE_CHECKING:
    from rig.network.discovery import Seen

_EVERY_S = 1.0
_HEADINGS = ("rig", "scene", "state", "strikes", "round trip", "present")


class _Shown(NamedTuple):
    # What counts as a change; strikes and round trips always do change.
    scene: str | None
    state: str
    services: tuple[tuple[str, int], ...]


def show(end: RemoteRig, as_json: bool) -> None:
    """Print what there is now. Raises CommandError where no router answers."""
    from rig.network.discovery import Network

    with opened(end) as session:
        seen = Network(session).poll()
    print(_object(end, seen) if as_json else _table(end, seen))


def watch(end: RemoteRig, as_json: bool, duration_s: float | None) -> None:
    """Print what there is, then what comes, changes and goes, until Ctrl-C or for `duration_s`."""
    from rig.network.discovery import Network

    until = None if duration_s is None else time.monotonic() + duration_s
    before: dict[str, _Shown] | None = None
    with opened(end) as session:
        network = Network(session)
        while until is None or time.monotonic() < until:
            seen = network.poll()
            now = {each.rig: _shown(each) for each in seen}
            if as_json and now != before:
                print(_object(end, seen), flush=True)
            elif before is None:
                print(_table(end, seen), flush=True)
            else:
                for line in changes(before, now):
                    print(f"{time.strftime('%H:%M:%S')}  {line}", flush=True)
            before = now
            time.sleep(_EVERY_S)


def changes(before: dict[str, _Shown], now: dict[str, _Shown]) -> list[str]:
    """One line for each rig that came, changed or went."""
    lines = [f"{rig}: gone" for rig in sorted(before.keys() - now.keys())]
    for rig, shown in sorted(now.items()):
        if rig not in before:
            lines.append(f"{rig}: came: {_words(shown)}")
        elif shown != before[rig]:
            lines.append(f"{rig}: {_words(shown)}")
    return lines


def _shown(seen: "Seen") -> _Shown:
    return _Shown(seen.scene, seen.state, tuple(seen.services.items()))


def _words(shown: _Shown) -> str:
    return f"{foreign(shown.scene or 'no scene')}, {foreign(shown.state)}; {_present(dict(shown.services))}"


def _present(services: dict[str, int]) -> str:
    return foreign(", ".join(f"{name} {count}" for name, count in services.items()))


def _object(end: RemoteRig, seen: "Sequence[Seen]") -> str:
    return json.dumps({"router": end.endpoint, "rigs": [each._asdict() for each in seen]})


def _table(end: RemoteRig, seen: "Sequence[Seen]") -> str:
    if not seen:
        return (
            f"no rig at {end.endpoint}: the router there answers and knows of none; start one with `drumstick up`,"
            " or ask another router (--connect)"
        )
    rows = [_HEADINGS, *(_row(each) for each in seen)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADINGS))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    doubled = [each.rig for each in seen if each.services.get("haptic", 0) > 1]
    lines += [f"{rig}: several haptic servers have this name: give each its own (--rig)" for rig in doubled]
    return "\n".join(line.rstrip() for line in lines)


def _row(seen: "Seen") -> tuple[str, ...]:
    return (
        seen.rig,
        foreign(seen.scene or "-"),
        foreign(seen.state),
        "-" if seen.strikes is None else str(seen.strikes),
        "-" if seen.round_trip_ms is None else f"{seen.round_trip_ms:.1f} ms",
        _present(seen.services),
    )
