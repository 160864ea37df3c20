"""A real haptic machine that plays, with a public listener and the keys of everybody."""

import json
import subprocess
from pathlib import Path
from typing import Any

import zenoh
from rig_process import DRUMSTICK, PATIENCE_S, Rig, ask, free_port

from protocol.access.identity import Identity
from protocol.keys import Keys
from protocol.session import open_client
from rig.identity.rig_file import load


class Stage:
    """A haptic machine that plays, with a public listener, and the keys of everybody."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.keys_folder = folder / "keys"
        subprocess.run(
            [*DRUMSTICK, "keys", "make", "--out", self.keys_folder, "--host", "127.0.0.1", "--days", "60"],
            check=True, capture_output=True, timeout=PATIENCE_S,
        )  # fmt: skip
        for path in self.keys_folder.glob("*/rig.toml"):
            text = path.read_text().replace("0.0.0.0", "127.0.0.1").replace(":7448", f":{self.port}")
            path.write_text(text)
        with self.file("haptic").open("a") as file:
            # A stranger by OSC is one whose address is not here.
            file.write('\n[osc]\nallow = ["127.0.0.1/32"]\n')
        self.rig = Rig("haptic", "--rig-file", str(self.file("haptic")))
        self.endpoint = f"tls/127.0.0.1:{self.port}"
        self.keys: Keys = self.rig.keys

    def file(self, role: str) -> Path:
        return self.keys_folder / role / "rig.toml"

    def identity(self, role: str) -> Identity:
        identity = load(self.file(role)).identity
        assert identity is not None
        return identity

    def client(self, role: str) -> zenoh.Session:
        session = open_client(self.endpoint, lambda: True, self.identity(role))
        assert session is not None
        return session

    def command(self, *words: str, role: str, status: int = 0) -> str:
        """Output of a `drumstick` command with the keys of `role`; its exit status is checked."""
        done = subprocess.run(
            [*DRUMSTICK, *words, "--rig", self.rig.name, "--rig-file", str(self.file(role))],
            capture_output=True, text=True, timeout=PATIENCE_S, check=False,
        )  # fmt: skip
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout + done.stderr

    def doctor(self, session: zenoh.Session) -> dict[str, Any]:
        return json.loads(ask(session, self.keys.doctor))

    def door(self, session: zenoh.Session) -> dict[str, Any]:
        return json.loads(ask(session, self.keys.door))
