"""Commands that talk to a running rig over Zenoh: params, preset, panic."""

import json
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import msgspec

from protocol.endpoint import host_and_port, is_tls
from protocol.foreign_text import shown
from protocol.keys import command
from protocol.messages import PresetNews, PresetReply, Readback, RefusalReply, SetReply, decode
from protocol.session import client_config
from rig.exit_status import unavailable, usage_error
from rig.network.ports import listens
from rig.network.remote_rig import RemoteRig

_OPENED_WITHIN_S = 10.0
_ANSWER_WITHIN_S = 2.0
_WRITTEN_WITHIN_S = 10.0  # a slow card needs a second for each file
_TIMEOUT = b"Timeout"  # how Zenoh words its own, as an error reply
_COMPILED_WITHIN_S = 180.0  # the first roll of a scene that is new to the machine
_MAX_REASON = 1000  # names of parameters that there are may be in it


def attempt(end: RemoteRig, keep_on: Callable[[], bool] = lambda: True) -> tuple[Any, str]:
    """A session of its own, or None and why there is none; without words no router answers.

    Whoever listens there but takes longer than a try lasts, on a slow network or machine, is asked again, for ten
    seconds at most and while `keep_on()`.
    """
    if not is_tls(end.endpoint) and not listens(*host_and_port(end.endpoint)):
        # Zenoh would take longer to find out, and a process that failed to open was seen not to end.
        return None, ""
    import zenoh

    from protocol.access import handshake

    words, until = "", time.monotonic() + _OPENED_WITHIN_S
    while keep_on() and time.monotonic() < until:
        try:
            return zenoh.open(client_config(end.endpoint, end.identity)), ""
        except zenoh.ZError:
            why = None if end.identity is None else handshake.why_refused(end.endpoint, end.identity)
        words = "" if why is None else why.words
        if why is not None and not why.may_be_slow:
            break
    return None, words


@contextmanager
def opened(end: RemoteRig, keep_on: Callable[[], bool] = lambda: True) -> Generator[Any]:
    """A session of its own, closed at the end; Stop with the reason where there is none."""
    session, refused = attempt(end, keep_on)
    if session is None:
        unavailable(
            refused
            or f"no router answers at {end.endpoint}: start a rig with `drumstick up`, or name its router with"
            " --connect"
        )
    try:
        yield session
    finally:
        session.close()


def _ask(
    session: Any, key: str, payload: bytes | None = None, within_s: float = _ANSWER_WITHIN_S
) -> list[Any]:
    """The good replies; Stop with the reason of a refusal, or when nobody answers."""
    replies: list[Any] = []
    for reply in session.get(key, payload=payload, timeout=within_s):
        if reply.ok is None:
            if reply.err.payload.to_bytes() == _TIMEOUT:
                unavailable(f"no answer to {key} within {within_s:g} s: it may have been done all the same")
            usage_error(shown(decode(reply.err.payload.to_bytes(), RefusalReply).reason, _MAX_REASON))
        replies.append(reply.ok)
    if not replies:
        unavailable(
            f"nobody answers {key}: is a rig of that name running, and does this role have access? (--rig, --rig-file)"
        )
    return replies


def params_get(end: RemoteRig, names: list[str], as_json: bool) -> None:
    """Print what the servo uses."""
    with opened(end) as session:
        values: dict[str, float] = {}
        for name in names or ["*"]:
            for sample in _ask(session, end.keys.param(name)):
                values[str(sample.key_expr).rpartition("/")[2]] = decode(
                    sample.payload.to_bytes(), Readback
                ).value
    print(
        json.dumps(values) if as_json else "\n".join(f"{shown(n)} = {v:g}" for n, v in sorted(values.items()))
    )


def params_set(end: RemoteRig, pairs: list[str], as_json: bool) -> None:
    """Set values, NAME=VALUE, all or none; print the readback."""
    changes: dict[str, float] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        try:
            changes[name] = float(value)
        except ValueError:
            usage_error(
                f"{pair!r}: write NAME=NUMBER, e.g. dv_pls=0.3" if equals else f"{pair!r}: write NAME=NUMBER"
            )
    with opened(end) as session:
        payload = msgspec.msgpack.encode([1, changes])
        reply = decode(_ask(session, end.keys.set_many, payload)[0].payload.to_bytes(), SetReply)
    _print_set(reply, as_json)


def _print_set(reply: SetReply | PresetReply, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"values": reply.values, "revision": reply.revision, "pending": reply.pending}))
        return
    waits = "  (accepted; takes effect when the stick is above the head)" if reply.pending else ""
    print("\n".join(f"{shown(n)} = {v:g}{waits}" for n, v in reply.values.items()))


def play(end: RemoteRig, rate_Hz: float | None, level: float | None, seconds: float, as_json: bool) -> None:
    """Ask for a roll and print the values that make it; without rate and level print the roll that there is."""
    asked = {"rate": rate_Hz, "level": level}
    with opened(end) as session:
        if rate_Hz is None and level is None:
            found = {
                name: decode(
                    _ask(session, key, within_s=_COMPILED_WITHIN_S)[0].payload.to_bytes(), Readback
                ).value
                for name, key in (("rate", end.keys.play_rate), ("level", end.keys.play_level))
            }
            print(json.dumps(found) if as_json else f"{found['rate']:.4g} Hz at level {found['level']:.3g}")
            return
        roll = {name: value for name, value in asked.items() if value is not None} | {"seconds": seconds}
        payload = msgspec.msgpack.encode([1, roll])
        replies = _ask(session, end.keys.play_roll, payload, _COMPILED_WITHIN_S)
    _print_set(decode(replies[0].payload.to_bytes(), SetReply), as_json)


def params_watch(end: RemoteRig, duration_s: float | None) -> None:
    """Print every accepted change, one line each, until Ctrl-C or for `duration_s`."""
    import zenoh

    until = None if duration_s is None else time.monotonic() + duration_s
    with opened(end) as session:
        changes = session.declare_subscriber(end.keys.param("*"), zenoh.handlers.RingChannel(256))
        while until is None or time.monotonic() < until:
            while (sample := changes.try_recv()) is not None:
                readback = decode(sample.payload.to_bytes(), Readback)
                waits = " (waits)" if readback.pending else ""
                name = shown(str(sample.key_expr).rpartition("/")[2])
                print(f"{name} = {readback.value:g}{waits}", flush=True)
            time.sleep(0.05)


def preset_save(end: RemoteRig, name: str) -> None:
    """Keep what was accepted last under this name."""
    with opened(end) as session:
        payload = msgspec.msgpack.encode([1, name])
        news = decode(
            _ask(session, end.keys.preset_save, payload, _WRITTEN_WITHIN_S)[0].payload.to_bytes(), PresetNews
        )
    print(f"preset {shown(news.name)} saved on the haptic machine")


def preset_rename(end: RemoteRig, name: str, new: str) -> None:
    """Give a preset another name."""
    with opened(end) as session:
        payload = msgspec.msgpack.encode([1, [name, new]])
        news = decode(
            _ask(session, end.keys.preset_rename, payload, _WRITTEN_WITHIN_S)[0].payload.to_bytes(),
            PresetNews,
        )
    print(f"preset {shown(news.before)} is now called {shown(news.name)}")


def preset_delete(end: RemoteRig, name: str) -> None:
    """Delete a preset."""
    with opened(end) as session:
        payload = msgspec.msgpack.encode([1, name])
        news = decode(
            _ask(session, end.keys.preset_delete, payload, _WRITTEN_WITHIN_S)[0].payload.to_bytes(),
            PresetNews,
        )
    print(f"preset {shown(news.name)} deleted on the haptic machine")


def preset_load(end: RemoteRig, name: str, as_json: bool) -> None:
    """Set everything that the preset holds; print the readback."""
    with opened(end) as session:
        payload = msgspec.msgpack.encode([1, name])
        reply = decode(_ask(session, end.keys.preset_load, payload)[0].payload.to_bytes(), PresetReply)
    if reply.note:
        print(f"drumstick: {shown(reply.note, _MAX_REASON)}", file=sys.stderr)
    _print_set(reply, as_json)


def preset_list(end: RemoteRig, as_json: bool) -> None:
    """One line for each preset."""
    with opened(end) as session:
        listed = json.loads(_ask(session, end.keys.preset)[0].payload.to_bytes())
    if as_json:
        print(json.dumps({"presets": listed}))
        return
    for row in listed:
        trouble = f"  ({shown(row['trouble'])})" if row["trouble"] else ""
        print(f"{shown(row['name'])}  {shown(row['scene'])}, {shown(row['saved_at'])}{trouble}")


def panic(end: RemoteRig) -> None:
    """Zero force, latched."""
    with opened(end) as session:
        _ask(session, end.keys.panic)
    print(f"panic: zero force; clear it on the haptic machine with: {command('arm', end.keys.rig)}")


def health(end: RemoteRig) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Reports of the gateway, and of the public listener if there is one. CommandError when the gateway is silent."""
    with opened(end) as session:
        gateway = json.loads(_ask(session, end.keys.doctor)[0].payload.to_bytes())
        replies = [reply.ok for reply in session.get(end.keys.door, timeout=_ANSWER_WITHIN_S) if reply.ok]
        return gateway, json.loads(replies[0].payload.to_bytes()) if replies else None
