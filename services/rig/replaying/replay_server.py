"""In the haptic server's place on Zenoh: answers what it answers, publishes what it publishes, takes no sets.

`put` belongs to the playing thread. Queries arrive on zenoh's threads, which only queue them; one worker answers.
"""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable, Mapping

import zenoh

from protocol import messages
from protocol.keys import Keys
from protocol.messages import Clock, Message
from protocol.query_thread import Questions
from protocol.queryables import Queryables
from rig.recording import channels
from rig.recording.channels import Channel

_ASK_S = 0.5


def new_boot() -> int:
    """Tells this start from every other, as a servo's boot does: 48 bits of time and chance."""
    return (int(time.time()) << 16 | secrets.randbits(16)) & 0xFFFFFFFFFFFF


def present(session: zenoh.Session, key: str) -> list[str]:
    """The liveliness tokens of that key there are now. Blocks up to half a second."""
    replies = session.liveliness().get(key, timeout=_ASK_S)
    return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]


class ReplayServer:
    """Stand-in for one rig. `scene`: JSON; `what`: reason for refusing a set; `on_panic` is called on the worker."""

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        boot: int,
        scene: bytes,
        what: str,
        on_panic: Callable[[], None],
        health: Callable[[], Mapping[str, object]],
    ) -> None:
        self._session, self._keys, self._boot, self._scene = session, keys, boot, scene
        self._what, self._on_panic, self._health = what, on_panic, health
        self._encoding = zenoh.Encoding(messages.ENCODING)
        self._json = zenoh.Encoding.APPLICATION_JSON
        self._questions = Questions("queries", self._answer)
        self._readbacks: dict[str, bytes] = {}
        self._publishers = {
            channel: session.declare_publisher(key, encoding=self._encoding)
            for channel, key in (
                (channels.STRIKE, keys.strike),
                (channels.RELEASE, keys.release),
                (channels.CHOKE, keys.choke),
                (channels.CONTACT, keys.contact),
                (channels.STATE, keys.state),
            )
        }
        self.queryables = Queryables(session)
        for key in (keys.param("*"), keys.scene, keys.clock, keys.doctor):
            self.queryables.declare_reading(key, self._questions.receive)
        for key in (keys.set_many, keys.set_one("*"), keys.panic):
            self.queryables.declare_writing(key, self._questions.receive)
        self._token = session.liveliness().declare_token(keys.alive("haptic", f"{boot:x}"))

    def put(self, channel: Channel, name: str, message: Message) -> None:
        """Publish one message; a readback is also what `param/NAME` answers from now on."""
        payload = messages.encode(message)
        if channel is channels.PARAM:
            self._readbacks[name] = payload
            self._session.put(self._keys.param(name), payload, encoding=self._encoding)
        else:
            self._publishers[channel].put(payload)

    def close(self) -> None:
        """Stop answering. The caller closes the session."""
        self._questions.close()

    def _answer(self, query: zenoh.Query) -> bool:
        key, keys = str(query.key_expr), self._keys
        if key == keys.set_many or key.startswith(keys.set_one("")):
            raise ValueError(f"this is {self._what}: nothing can be set")
        if key.startswith(keys.param("")):
            self._answer_param(query, key.removeprefix(keys.param("")))
        elif key == keys.scene:
            query.reply(keys.scene, self._scene, encoding=self._json)
        elif key == keys.clock:
            clock = Clock(boot=self._boot, t_ns=time.monotonic_ns())
            query.reply(keys.clock, messages.encode(clock), encoding=self._encoding)
        elif key == keys.doctor:
            query.reply(keys.doctor, json.dumps(self._health()), encoding=self._json)
        elif key == keys.panic:
            self._on_panic()
            query.reply(keys.panic, messages.encode(Message()), encoding=self._encoding)
        else:
            raise ValueError(f"{key}: name one key; wildcards are for param/* only")
        return True

    def _answer_param(self, query: zenoh.Query, name: str) -> None:
        known = dict(self._readbacks)
        found = known if name in ("*", "**") else {n: p for n, p in known.items() if n == name}
        if not found:
            raise ValueError(
                f"{name}: no such parameter in this recording; it has {', '.join(sorted(known))}"
            )
        for each, payload in found.items():
            query.reply(self._keys.param(each), payload, encoding=self._encoding)
