"""The panel's Zenoh session: opened as soon as there is a router, asked by any thread, closed at the end."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable

import msgspec
import zenoh

from protocol.access.identity import Identity
from protocol.keys import Keys
from protocol.messages import ENCODING, VERSION, LeaseRequest, Pointer, encode
from protocol.session import open_client
from web_panel.rig.answer import NO_ANSWER, Answer, accepted, all_accepted, loaded
from web_panel.rig.answer import refused as reason_of
from web_panel.rig.listener import Listener
from web_panel.rig.rig_state import RigState
from web_panel.rig.set_request import ROLL, SetRequest

_TIMEOUT_S = 2.0
_ROLL_TIMEOUT_S = 10.0  # the gateway starts a program to find the first one
_SAVE_TIMEOUT_S = 5.0
_LEASE_TIMEOUT_S = 1.0
_PLAY_TIMEOUT_S = 1.0
_PLAYER = "page"
_PANIC_TRIES = 3
_PANIC_TIMEOUT_S = 0.5
_NO_ROUTER = "not connected to the rig yet: nothing was sent"


def _claimed(given: object, lease: str) -> bytes:
    return msgspec.msgpack.encode([VERSION, given, {"lease": lease}] if lease else [VERSION, given])


class RigLink:
    """One session with one rig. `poll` belongs to the main thread; `set` and all below it block, for any other.

    `point`, `play` and `choke` are for viser's thread and do not block.
    """

    def __init__(
        self, rig: str, endpoint: str, rig_state: RigState, identity: Identity | None = None
    ) -> None:
        self.keys = Keys(rig)
        self._rig_state = rig_state
        self._endpoint = endpoint
        self._identity = identity
        self._session: zenoh.Session | None = None
        self._listener: Listener | None = None
        self._closing = threading.Event()
        self._opening = threading.Thread(target=self._open, name="zenoh open", daemon=True)

    def start(self) -> None:
        """Begin to look for the router; returns at once, so that the page is there before the rig is."""
        self._opening.start()

    def _open(self) -> None:
        session = open_client(self._endpoint, lambda: not self._closing.is_set(), self._identity)
        if session is None:
            return
        self._token = session.liveliness().declare_token(self.keys.alive("panel", secrets.token_hex(4)))
        self._listener = Listener(session, self.keys, self._rig_state)
        # Dropped rather than waited for: the next is never far, and an old one is worth nothing.
        self._pointer = session.declare_publisher(
            self.keys.pointer,
            encoding=ENCODING,
            congestion_control=zenoh.CongestionControl.DROP,
            reliability=zenoh.Reliability.BEST_EFFORT,
        )
        self._session = session

    def close(self) -> None:
        """Close the session; without this the process would not end."""
        self._closing.set()
        self._opening.join()
        if self._session is not None:
            self._session.close()  # pyright: ignore[reportUnknownMemberType]

    def poll(self, now: float) -> None:
        """Bring the state up to date. Never blocks."""
        if self._listener is not None:
            self._listener.poll(now)

    def watch(self, needs: frozenset[str]) -> None:
        """Hear what is looked at (watching), and no more than that."""
        if self._listener is not None:
            self._listener.watching.want(needs)

    def point(self, pointer: Pointer) -> None:
        """Tell where a pointer wants the stick; nobody answers, and only a rig that follows one listens."""
        if self._session is not None:
            self._pointer.put(encode(pointer))

    def play(self, x: float, y: float, level: float, refused: Callable[[str], None]) -> None:
        """Ask for a strike; `refused` is called with words where there is none, maybe on Zenoh's thread."""
        self._play(self.keys.play_strike, [x, y, level, _PLAYER], refused)

    def choke(self, refused: Callable[[str], None]) -> None:
        """Ask for a choke; `refused` as in `play`."""
        self._play(self.keys.play_choke, _PLAYER, refused)

    def _play(self, key: str, asked: object, refused: Callable[[str], None]) -> None:
        if self._session is None:
            refused(_NO_ROUTER)
            return

        def take(reply: zenoh.Reply) -> None:
            # zenoh words its own timeout as an error reply, in plain text.
            if reply.err is not None and reply.err.payload.to_bytes() != b"Timeout":
                refused(reason_of(reply.err.payload.to_bytes()).words)

        payload = msgspec.msgpack.encode([VERSION, asked])
        try:
            self._session.get(
                key,
                zenoh.handlers.Callback(take, indirect=False),
                payload=payload,
                encoding=ENCODING,
                timeout=_PLAY_TIMEOUT_S,
            )
        except zenoh.ZError as error:
            refused(f"{NO_ANSWER} ({error})")

    def check_again(self) -> None:
        """Ask for all readbacks soon: a value that was set may move others (k_hand moves z_h0)."""
        if self._listener is not None:
            self._listener.check_again()

    def set(self, request: SetRequest) -> Answer:
        """Ask for the request's values as one set and wait for the answer, 2 s at most; 10 s for a roll."""
        if request.purpose == ROLL:
            payload = _claimed(request.values, request.lease)
            return self._ask(self.keys.play_roll, payload, _ROLL_TIMEOUT_S, all_accepted)
        if not request.purpose:
            ((name, value),) = request.values.items()
            payload = _claimed(value, request.lease)
            return self._ask(
                self.keys.set_one(name), payload, _TIMEOUT_S, lambda reply: accepted(name, reply)
            )
        payload = _claimed(request.values, request.lease)
        return self._ask(self.keys.set_many, payload, _TIMEOUT_S, all_accepted)

    def load_preset(self, name: str, lease: str) -> Answer:
        """Ask for a whole preset and wait for the answer, 2 s at most."""
        return self._ask(self.keys.preset_load, _claimed(name, lease), _TIMEOUT_S, loaded)

    def load_scene(self, name: str, lease: str) -> Answer:
        """Ask for another scene, and wait until that is admitted, 2 s at most."""
        return self._ask(self.keys.scene_load, _claimed(name, lease), _TIMEOUT_S, lambda _: Answer())

    def take_lease(self, who: str, name: str, seconds: float) -> Answer:
        """Take, renew or (0 s) give back the writer's lease; waits for the answer, 1 s at most."""
        request = encode(LeaseRequest(who=who, name=name, seconds=seconds))
        return self._ask(self.keys.lease, request, _LEASE_TIMEOUT_S, lambda _: Answer())

    def save_preset(self, name: str) -> Answer:
        """Have the present values kept, which takes as long as the disk, 5 s at most."""
        payload = msgspec.msgpack.encode([VERSION, name])
        return self._ask(self.keys.preset_save, payload, _SAVE_TIMEOUT_S, lambda _: Answer())

    def rename_preset(self, name: str, new: str, lease: str) -> Answer:
        """Have a preset called otherwise, which takes as long as the disk, 5 s at most."""
        payload = _claimed([name, new], lease)
        return self._ask(self.keys.preset_rename, payload, _SAVE_TIMEOUT_S, lambda _: Answer())

    def delete_preset(self, name: str, lease: str) -> Answer:
        """Have a preset deleted, which takes as long as the disk, 5 s at most."""
        return self._ask(self.keys.preset_delete, _claimed(name, lease), _SAVE_TIMEOUT_S, lambda _: Answer())

    def panic(self) -> Answer:
        """Zero force, latched. Asked three times before it gives up, 1.5 s at most."""
        answer = Answer(reason=_NO_ROUTER)
        for _ in range(_PANIC_TRIES):
            begin = time.monotonic()
            answer = self._ask(self.keys.panic, b"", _PANIC_TIMEOUT_S, lambda _: Answer())
            if answer.taken:
                break
            # Where nobody listens zenoh says so at once; a gateway that is just starting deserves its half second.
            self._closing.wait(max(0.0, begin + _PANIC_TIMEOUT_S - time.monotonic()))
        return answer

    def _ask(self, key: str, payload: bytes, timeout_s: float, read: Callable[[bytes], Answer]) -> Answer:
        if self._session is None:
            return Answer(reason=_NO_ROUTER)
        try:
            replies = list(self._session.get(key, payload=payload, encoding=ENCODING, timeout=timeout_s))
        except zenoh.ZError as error:
            return Answer(reason=f"{NO_ANSWER} ({error})")
        for reply in replies:
            if reply.ok is not None:
                return read(reply.ok.payload.to_bytes())
        for reply in replies:
            # zenoh words its own timeout as an error reply, in plain text.
            if reply.err is not None and reply.err.payload.to_bytes() != b"Timeout":
                return reason_of(reply.err.payload.to_bytes())
        return Answer(reason=NO_ANSWER)
