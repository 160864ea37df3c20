"""Commands that talk to a running rig over Zenoh: params, preset, panic."""

import json
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import msgspec

from protocol.identity import Identity
from protocol.keys import Keys
from protocol.messages import PresetNews, PresetReply, Readback, RefusalReply, SetReply, decode
from protocol.session import client_config
from rig.fault import lacking, wrong

_ANSWER_WITHIN_S = 2.0


@contextmanager
def _session(endpoint: str, identity: Identity | None = None) -> Generator[Any]:
    import zenoh

    try:
        session = zenoh.open(client_config(endpoint, identity))
    except zenoh.ZError:
        from protocol import handshake

        if identity is not None and (why := handshake.why_refused(endpoint, identity)) is not None:
            lacking(why.words)
        lacking(
            f"no rig answers at {endpoint}: start one with `drumstick up`, or name its router with --connect"
        )
    try:
        yield session
    finally:
        session.close()


def _ask(session: Any, key: str, payload: bytes | None = None) -> list[Any]:
    """The good replies; Stop with the reason of a refusal, or when nobody answers."""
    replies: list[Any] = []
    for reply in session.get(key, payload=payload, timeout=_ANSWER_WITHIN_S):
        if reply.ok is None:
            wrong(decode(reply.err.payload.to_bytes(), RefusalReply).reason)
        replies.append(reply.ok)
    if not replies:
        lacking(
            f"nobody answers {key}: is a rig of that name running, and may we ask it? (--rig, --rig-file)"
        )
    return replies


def params_get(
    endpoint: str, keys: Keys, names: list[str], as_json: bool, identity: Identity | None = None
) -> None:
    """Print what the servo uses."""
    with _session(endpoint, identity) as session:
        values: dict[str, float] = {}
        for name in names or ["*"]:
            for sample in _ask(session, keys.param(name)):
                values[str(sample.key_expr).rpartition("/")[2]] = decode(
                    sample.payload.to_bytes(), Readback
                ).value
    print(json.dumps(values) if as_json else "\n".join(f"{n} = {v:g}" for n, v in sorted(values.items())))


def params_set(
    endpoint: str, keys: Keys, pairs: list[str], as_json: bool, identity: Identity | None = None
) -> None:
    """Set values, NAME=VALUE, all or none; print the readback."""
    changes: dict[str, float] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        try:
            changes[name] = float(value)
        except ValueError:
            wrong(
                f"{pair!r}: write NAME=NUMBER, e.g. dv_pls=0.3" if equals else f"{pair!r}: write NAME=NUMBER"
            )
    with _session(endpoint, identity) as session:
        payload = msgspec.msgpack.encode([1, changes])
        reply = decode(_ask(session, keys.set_many, payload)[0].payload.to_bytes(), SetReply)
    _print_set(reply, as_json)


def _print_set(reply: SetReply | PresetReply, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"values": reply.values, "revision": reply.revision, "pending": reply.pending}))
        return
    waits = "  (accepted; takes effect when the stick is above the head)" if reply.pending else ""
    print("\n".join(f"{n} = {v:g}{waits}" for n, v in reply.values.items()))


def params_watch(
    endpoint: str, keys: Keys, duration_s: float | None, identity: Identity | None = None
) -> None:
    """Print every accepted change, one line each, until Ctrl-C or for `duration_s`."""
    import zenoh

    end = None if duration_s is None else time.monotonic() + duration_s
    with _session(endpoint, identity) as session:
        changes = session.declare_subscriber(keys.param("*"), zenoh.handlers.RingChannel(256))
        while end is None or time.monotonic() < end:
            while (sample := changes.try_recv()) is not None:
                readback = decode(sample.payload.to_bytes(), Readback)
                waits = " (waits)" if readback.pending else ""
                print(f"{str(sample.key_expr).rpartition('/')[2]} = {readback.value:g}{waits}", flush=True)
            time.sleep(0.05)


def preset_save(endpoint: str, keys: Keys, name: str, identity: Identity | None = None) -> None:
    """Keep what was accepted last under this name."""
    with _session(endpoint, identity) as session:
        payload = msgspec.msgpack.encode([1, name])
        news = decode(_ask(session, keys.preset_save, payload)[0].payload.to_bytes(), PresetNews)
    print(f"preset {news.name} saved on the haptic machine")


def preset_load(
    endpoint: str, keys: Keys, name: str, as_json: bool, identity: Identity | None = None
) -> None:
    """Set everything that the preset holds; print the readback."""
    with _session(endpoint, identity) as session:
        payload = msgspec.msgpack.encode([1, name])
        reply = decode(_ask(session, keys.preset_load, payload)[0].payload.to_bytes(), PresetReply)
    if reply.note:
        print(f"drumstick: {reply.note}", file=sys.stderr)
    _print_set(reply, as_json)


def preset_list(endpoint: str, keys: Keys, as_json: bool, identity: Identity | None = None) -> None:
    """One line for each preset."""
    with _session(endpoint, identity) as session:
        listed = json.loads(_ask(session, keys.preset)[0].payload.to_bytes())
    if as_json:
        print(json.dumps({"presets": listed}))
        return
    for row in listed:
        trouble = f"  ({row['trouble']})" if row["trouble"] else ""
        print(f"{row['name']}  {row['scene']}, {row['saved_at']}{trouble}")


def panic(endpoint: str, keys: Keys, identity: Identity | None = None) -> None:
    """Zero force, latched."""
    with _session(endpoint, identity) as session:
        _ask(session, keys.panic)
    print("panic: zero force; clear it on the haptic machine with: drumstick arm")


def health(endpoint: str, keys: Keys, identity: Identity | None = None) -> dict[str, Any]:
    """What the gateway tells about itself. Raises Stop when it does not answer."""
    with _session(endpoint, identity) as session:
        return json.loads(_ask(session, keys.doctor)[0].payload.to_bytes())
