"""Counts of handshakes refused at the public listener, read from Zenoh's log: Zenoh keeps no such numbers itself.

Three kinds are told there: handshakes that failed (no certificate, another authority's, out of date, no TLS at all),
certificates of no admitted role, and messages beyond the sender's role. What a session does within its role is counted
too, against limits. Zenoh lets ten failed handshakes through in a second at most. Of messages its log tells every one,
permitted or not: that is why the listener has a process of its own, in which a full pipe holds up nobody on the haptic
machine.

Zenoh logs to the process's standard output; that is turned into a pipe here, and a thread of its own reads it. Who sets
RUST_LOG gets the log that he asks for, by way of ours, and these counters count what of it is a refusal.
"""

import logging
import os
import re
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable

from haptic_server.access.disconnection import TURNED_BACK_S
from haptic_server.access.session_limits import SessionLimits
from protocol.foreign_text import shown

_log = logging.getLogger("door")
_RULES = "zenoh::net::routing::interceptor::access_control"
_FILTER = f"error,zenoh_link_tls=warn,{_RULES}=trace"
_BEGIN = "\x1b[2m"  # of each of Zenoh's own lines: the colour of its time, which no name that it quotes can contain
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_HANDSHAKE = re.compile(r"zenoh_link_tls\S*: (?P<why>.*?)\. Hint: ")
_NO_ROLE = re.compile(r"(?P<who>[0-9a-f]+) did not match any configured ACL subject")
_THREAD = re.compile(r"ThreadId\((?P<thread>\d+)\)")
_CACHING = re.compile(r"ACL \((in|e)gress\): caching permissions for `(?P<key>.*)` \.\.\.$")
_CACHED = "Using cached result: "
_OF_ROLE = re.compile(r"(?P<who>[0-9a-f]+) on \S*CertCommonName\((?P<role>[^)]*)\)")
_DONE = re.compile(
    r"(?P<who>[0-9a-f]+) (?:on \S+ )?is authorized to (?P<what>.+?) \(ingress\) on (?P<key>\S+)"
)
_BEYOND = re.compile(
    r"(?P<who>[0-9a-f]+) (?:on \S+ )?is unauthorized to (?P<what>.+?) \(ingress\) on (?P<key>\S+)"
)
# For each key that is declared Zenoh asks its rules about every kind of message at once, and logs that as well.
_KINDS_OF_MESSAGE = 9
_MAX_KNOWN = 10_000
_LINE_EVERY_S = 10.0
_LONGEST = 200


class Refusals:
    """Counters may be read from any thread; `take` belongs to the one that reads."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._report_at_s = float("-inf")
        self._unreported = 0
        self._other_at_s = float("-inf")
        self._expected: dict[
            str, tuple[str, int]
        ] = {}  # thread -> how many lines on which key are still no messages
        self._role_of: dict[str, str] = {}  # Zenoh's name of a session -> role
        self._allowances = SessionLimits(now)
        self.cut: Callable[[str], None] = lambda who: None  # ends a session; called by the thread that reads
        self.over_limit: Counter[str] = Counter()
        self.handshakes = 0
        self.without_role = 0
        self.beyond_role: Counter[str] = Counter()
        self.last = ""

    def take(self, line: str) -> None:
        """One line of Zenoh's log. Others than those about access are handed on to our own log, one in ten seconds."""
        if not line.startswith(_BEGIN):
            return  # the rest of a line that quotes a name with a line break in it, which a client chose
        words = _COLOURS.sub("", line).strip()
        source, _, said = words.partition(": ")
        if source.endswith(_RULES):
            self._take_rule(words, said)
        elif found := _HANDSHAKE.search(words):
            self.handshakes += 1
            self._note(f"a handshake failed: {shown(found['why'], _LONGEST)}")
        elif self._now() >= self._other_at_s:
            self._other_at_s = self._now() + _LINE_EVERY_S
            _log.warning("%s", shown(words, _LONGEST))

    def _take_rule(self, words: str, said: str) -> None:
        if found := _CACHING.match(said):
            self._expected[_thread_of(words)] = found["key"], _KINDS_OF_MESSAGE
        elif _NO_ROLE.match(said):
            self.without_role += 1
            self._note("a certificate of no admitted role came in, and may do nothing")
        elif "authorized to" in said:
            if found := _OF_ROLE.match(said):
                if len(self._role_of) >= _MAX_KNOWN:  # a name that is forgotten is learnt again
                    self._role_of.clear()
                self._role_of[found["who"]] = found["role"]
            if self._was_expected(words, said):
                return
            did = said.removeprefix(_CACHED)
            if beyond := _BEYOND.match(did):
                self._note_beyond(beyond)
            elif (done := _DONE.match(did)) and done["who"] in self._role_of:
                self._note_done(done)

    def _was_expected(self, words: str, said: str) -> bool:
        if said.startswith(_CACHED) or not self._expected:
            return False
        thread = _thread_of(words)
        key, left = self._expected.pop(thread, ("", 0))
        if not left or not said.endswith(f" on {key}"):
            return False
        if left > 1:
            self._expected[thread] = key, left - 1
        return True

    def _note_beyond(self, found: re.Match[str]) -> None:
        role = self._role_of.get(found["who"], "a certificate of no role")
        self.beyond_role[role] += 1
        self._note(f"{role} may not {found['what'].lower()} on {shown(found['key'])}")

    def _note_done(self, found: re.Match[str]) -> None:
        over = self._allowances.spend(found["who"], found["what"], found["key"])
        if over:
            role = self._role_of[found["who"]]
            self.over_limit[role] += 1
            self.cut(found["who"])
            self._note(
                f"{role} (session {found['who']}) has {over}, the limit of one session: its link was ended,"
                f" and it is turned back for {TURNED_BACK_S:g} s"
            )

    def _note(self, words: str) -> None:
        self.last = words
        self._unreported += 1
        if self._now() >= self._report_at_s:
            self._report_at_s = self._now() + _LINE_EVERY_S
            _log.warning("public listener: refused %d, last: %s", self._unreported, words)
            self._unreported = 0

    def counters(self) -> dict[str, object]:
        """Counts for `doctor`."""
        return {
            "handshakes_refused": self.handshakes,
            "without_role": self.without_role,
            "beyond_role": dict(self.beyond_role),
            "over_limit": dict(self.over_limit),
            "last": self.last,
        }

    def follow_zenoh(self) -> None:
        """Begin to read Zenoh's log. Once in a process, before its first session; standard output is gone from then."""
        import zenoh

        os.environ.pop("NO_COLOR", None)  # colours tell its own lines from what clients put in them
        sys.stdout.flush()
        inner, outer = os.pipe()
        os.dup2(outer, 1)
        os.close(outer)
        zenoh.init_log_from_env_or(_FILTER)
        threading.Thread(target=self._read, args=(inner,), name="zenoh log", daemon=True).start()

    def _read(self, inner: int) -> None:
        with os.fdopen(inner, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                self.take(line)


def _thread_of(words: str) -> str:
    found = _THREAD.search(words)
    return found["thread"] if found else ""
