"""Writes docs/zenoh.md and docs/wire.json from keys, messages, addresses and parameters: python
drumstick lab zenoh-page."""

import json

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from drumstick_lab.checkout import DOCS
from protocol import messages
from protocol.description import ZENOH, described, key_of, words_of, words_of_key

PAGE = DOCS / "zenoh.md"
DESCRIPTION = DOCS / "wire.json"


def _keys() -> list[str]:
    rows = ["| key | kind | payload | what |", "|---|---|---|---|"]
    for use in ZENOH:
        payload = (
            f"[{use.payload.__name__}](#payloads)" if use.payload else "JSON" if use.kind == "query" else ""
        )
        rows.append(f"| `{key_of(use, 'RIG')}` | {use.kind} | {payload} | {words_of_key(use)} |")
    return rows


def _payloads() -> list[str]:
    kinds = dict.fromkeys(use.payload for use in ZENOH if use.payload and use.payload is not messages.Message)
    lines: list[str] = []
    for kind in (*kinds, messages.LeaseRequest, messages.RefusalReply):
        fields = ", ".join(kind.__struct_fields__)
        lines += [f"**{kind.__name__}** `[{fields}]`. {words_of(kind)}", ""]
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
            "Made by `drumstick lab zenoh-page` from the code; do not edit. For programs that want more than OSC; programs that",
            "read it themselves find the same, and the OSC addresses, in [wire.json](wire.json).",
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
            "## Setting",
            "",
            "A query on `set/NAME` carries `[1, value]` in msgpack or a plain JSON number; one on `set` carries a map",
            "(`[1, {name: value}]`, or a JSON object) that is accepted or refused as a whole. `pending` is true while the set",
            "waits for the stick to be above the head. A refusal is an error reply, RefusalReply.",
            "",
            "Two who tune at once need not fight. A third element, the claim, is a map with one or both of:",
            "",
            "- `revision`: the newest revision that you know. If there is a newer one the set is refused, and you look again.",
            "- `lease`: your secret. Whoever takes the `lease` under a secret and a name is the only one who sets for five",
            "  seconds, and again five with each renewal; everybody sees the name. Nobody needs a lease to set while nobody holds",
            "  one, and a panic never needs one.",
            "",
            "## Presets",
            "",
            "`preset/save` keeps what was accepted last, in a file of the haptic machine (`~/.local/state/drumstick/RIG/presets`, or",
            "under `XDG_STATE_HOME`); `preset/load` sets all of it as one set, through the same envelope. Every file has a checksum over",
            "each of its bytes, is written whole or not at all, and the version before it is kept: where the newest is damaged, that",
            "one is loaded, and the answer's `note` says so.",
            "",
            "`preset/rename` carries `[1, [name, new name]]`, or a JSON list of both names; `preset/delete` one name. Both are refused while",
            "somebody else holds the lease, and take the version before along; a new name must be free. The news on `preset` tell what was",
            "done, and `before` is the name that a renamed one had. OSC has neither.",
            "",
            "What was set last in each scene is kept as well, within half a second, and is used again at the next start of the same rig with it:",
            "a power cut loses nothing. `--fresh` starts with the scene's own parameters. A set that brought the rig to a fault of motion",
            "within five seconds is not kept, but the one before it.",
            "",
            "## Playing without the stick",
            "",
            "A query on `play/strike` strikes the drum: `[1, [x, y, level]]`, with a name for whoever plays as a fourth",
            "element if you like; or `[x, y, level]` as JSON. No lease keeps it back. The answer is the Strike that was",
            "published. Its `boot` is none of a servo, and the same until the gateway starts anew; its `source` begins with",
            "the way it came: `osc`, `zenoh` or `midi`. Its Release follows when the contact is over. Whoever waits for a new",
            "start of the servo looks at messages whose `source` is `stick`. Limits and refusals:",
            "[osc.md](osc.md#playing-without-the-stick).",
            "",
            "A query on `play/choke` stops the drum: what rings fades in 30 ms, and the next strike sounds as always. It may",
            "carry the name of who plays. The answer is the Choke that was put on `choke`. Whoever makes sound of their own",
            "hears `strike` and `choke` on one session, in the order in which they were put.",
            "",
            "## Another scene",
            "",
            "A query on `scene/load` with the name of a shipped scene, or with `next` or `previous` where `drumstick up` has a set list, is answered at once. The scene is made",
            "ready while the present one plays: `state` names it as `next_scene`, and a query of `scene?next` gives its tables. Then a new servo takes over, and",
            "`boot` changes; sessions and keys stay. A scene that cannot be played changes nothing: `scene_refusal` in `state` says why, until the next wish.",
            "Refused beside somebody else's lease, in a panic, and by a haptic server that `drumstick` did not start.",
            "",
            "## Parameters of the scene `roll`",
            "",
            *_parameters(),
            "",
        ]
    )


def description() -> str:
    """The whole JSON file; its parameters are those of the scene `roll`."""
    return json.dumps(described(table_of(parse(shipped_text("roll"), "roll"))), indent=1) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    DESCRIPTION.write_text(description(), encoding="utf-8")
