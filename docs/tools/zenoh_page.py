"""Writes docs/zenoh.md from the keys, messages and parameters in the code: python docs/tools/zenoh_page.py."""

import inspect
from pathlib import Path

from drumstick.parameters import table_of
from drumstick.scene import parse, shipped_text
from protocol import messages
from protocol.keys import Keys

PAGE = Path(__file__).parent.parent / "zenoh.md"

_MESSAGES = {
    "strike": messages.Strike,
    "release": messages.Release,
    "contact": messages.Contact,
    "state": messages.State,
    "meter": messages.Meter,
    "param": messages.Readback,
    "clock": messages.Clock,
    "pointer": messages.Pointer,
}


def _first_line(thing: object) -> str:
    return " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())


def _keys() -> list[str]:
    keys = Keys("RIG")
    named = {
        "set_one": keys.set_one("NAME"),
        "param": keys.param("NAME"),
        "alive": keys.alive("SERVICE", "ID"),
    }
    rows = ["| key | what |", "|---|---|"]
    for name, member in vars(Keys).items():
        if name.startswith("_") or not (name in named or isinstance(member, property)):
            continue
        what = _first_line(member.fget if isinstance(member, property) else member)
        rows.append(f"| `{named.get(name) or getattr(keys, name)}` | {what} |")
    return rows


def _payloads() -> list[str]:
    lines: list[str] = []
    for key, kind in _MESSAGES.items():
        fields = ", ".join(kind.__struct_fields__)
        lines += [f"**{key}** `[{fields}]`. {_first_line(kind)}", ""]
    return lines


def _parameters() -> list[str]:
    rows = ["| name | symbol | unit | range | equation | what |", "|---|---|---|---|---|---|"]
    for name, row in table_of(parse(shipped_text("roll"), "roll")).items():
        q = row.quantity
        rows.append(
            f"| `{name}` | {q.symbol} | {q.unit} | {q.low:g} .. {q.high:g} | {q.equation} | {q.words} |"
        )
    return rows


def page() -> str:
    """The whole page."""
    return "\n".join(
        [
            "# Zenoh: keys, payloads, parameters",
            "",
            "Made by `docs/tools/zenoh_page.py` from the code; do not edit. For programs that want more than OSC.",
            "",
            "The haptic server's gateway is a Zenoh router on `tcp/127.0.0.1:7447` (`--listen`), or a client of yours",
            "(`--connect`). Everything else connects as a client. RIG is `main` unless `--rig` says otherwise. Programs on",
            "other machines come in over TLS, with the rights of their certificate: [security.md](security.md).",
            "",
            *_keys(),
            "",
            "## Payloads",
            "",
            "msgpack arrays (encoding `application/msgpack`); the first element is the version, 1. SI units;",
            "t_ns is the haptic machine's monotonic clock, which `clock` tells.",
            "",
            *_payloads(),
            "A query on `set/NAME` carries `[1, value]` in msgpack or a plain JSON number; one on `set` carries a",
            "map (`[1, {name: value}]`, or a JSON object) that is accepted or refused as a whole. The answer is the",
            "readback, `[1, value, revision, pending]` or `[1, {name: value}, revision, pending]`; `pending` is true",
            "while the set waits for the stick to be above the head. A refusal is an error reply, `[1, reason]`.",
            "",
            "## Parameters of the scene `roll`",
            "",
            *_parameters(),
            "",
        ]
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
