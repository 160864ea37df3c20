"""Asking for another scene: the gateway admits it, whoever started gateway and servo acts on it. Any gateway thread."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

from drumstick.scenes.scene_text import shipped_names
from drumstick.scenes.table import Refusal
from haptic_server import block_header, files, set_list
from haptic_server.set_list import NEXT, PREVIOUS
from protocol.requests import ANYBODY, Claim
from realtime.regular_file import read_text

_MAX_WORDS_BYTES = 4096


class _Due:
    # Place in the set list that was asked for last and not refused; `lock` is held while one is asked for.
    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.place: int | None = None


class SceneRequests:
    """`is_supervised`: whether somebody looks for the file that a wish leaves in the run folder.

    `require_quiet` raises Refusal where things stand so that nobody with that claim may start another scene.
    Steps through the set list set out from the scene that was asked for last: two quick ones are two.
    """

    def __init__(self, run_dir: Path, is_supervised: bool, require_quiet: Callable[[Claim], None]) -> None:
        self._run_dir, self._refused = run_dir, run_dir / files.REFUSED
        self._is_supervised = is_supervised
        self._require_quiet = require_quiet
        self._due = _Due()

    def ask_for(self, name: str, claim: Claim = ANYBODY) -> None:
        """Leave the wish for a shipped scene, or for the next or previous one of the set list. Raises Refusal."""
        with self._due.lock:
            if name in (NEXT, PREVIOUS):
                place = self._step(1 if name == NEXT else -1)
                self._leave(str(place), claim, place)
            elif name in shipped_names():
                self._leave(name, claim)
            else:
                raise Refusal(f"no scene {name[:80]!r}; shipped: {', '.join(shipped_names())}")

    def _step(self, by: int) -> int:
        listed = set_list.read(self._run_dir)
        if listed is None:
            raise Refusal("scene: no set list: start with `drumstick up --set-list FILE`")
        at = listed.at if self._due.place is None else self._due.place
        if not 0 <= at + by < len(listed.scenes):
            where = "ends" if by > 0 else "begins"
            raise Refusal(
                f"scene: the set list {where} with the one that {'plays' if at == listed.at else 'comes'}"
            )
        return at + by

    def ask_for_program(self, program: int) -> None:
        """Leave the wish for a scene by its number from 0: in the set list, without one among the shipped. Refusal."""
        with self._due.lock:
            listed = set_list.read(self._run_dir)
            names = list(listed.scenes) if listed else shipped_names()
            if program >= len(names):
                raise Refusal(f"scene: no number {program + 1}: there are {len(names)}")
            if listed:
                self._leave(str(program), ANYBODY, program)
            else:
                self._leave(names[program], ANYBODY)

    def take_refusal(self) -> str:
        """Reason why a scene that was asked for does not play, once; "" otherwise. Steps then begin at what plays.

        One that was asked for since is not meant: its request is still there, or the refusal went with it.
        """
        path = self._refused
        if not path.exists():  # as at nearly every look
            return ""
        with self._due.lock:
            newer = (self._run_dir / files.WANTED).exists()
            try:
                words = read_text(path, _MAX_WORDS_BYTES)
                path.unlink()
            except (OSError, UnicodeDecodeError):
                return ""
            if not newer:
                self._due.place = None
        return words

    def follow(self, before: "SceneRequests") -> None:
        """Share what was asked for with the requests of the scene before, which are open a moment longer."""
        self._due = before._due

    def _leave(self, wish: str, claim: Claim, place: int | None = None) -> None:
        self._require_quiet(claim)
        if not self._is_supervised:
            raise Refusal(
                "scene: this haptic server was not started by `drumstick`, which alone changes scenes"
            )
        if block_header.is_stuck(self._run_dir):
            # A servo put in its place would be free, and nobody would know of the fault.
            raise Refusal(
                "scene: a fault: the servo process does not tick; wait until it does, or restart the rig"
            )
        beside = self._run_dir / f".{files.WANTED}.{os.getpid()}"
        try:
            beside.write_text(wish, encoding="utf-8")
            beside.replace(self._run_dir / files.WANTED)
        except OSError as error:
            raise Refusal(f"scene: {self._run_dir} cannot be written: {error.strerror}") from None
        self._due.place = place
