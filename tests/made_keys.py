"""Certificates for tests: an authority in a folder, and whatever it is asked to make, good or bad."""

from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path

from protocol.access.identity import Identity
from rig.identity import certificates


class Keyring:
    """One authority. `identity` makes a new certificate at each call."""

    def __init__(self, folder: Path, name: str = "test") -> None:
        self._folder = folder
        self._authority = certificates.new_authority(name, certificates.present())
        folder.mkdir(mode=0o700, exist_ok=True)
        self.authority = self._put("ca.pem", self._authority.certificate_pem)
        self._made = 0

    def _put(self, name: str, content: bytes) -> Path:
        path = self._folder / name
        path.write_bytes(content)
        path.chmod(0o600)
        return path

    def identity(
        self, role: str, hosts: Sequence[str] = (), days: float = 1.0, begun: datetime | None = None
    ) -> Identity:
        self._made += 1
        begun = begun or certificates.present()
        pair = certificates.new_pair(self._authority, role, hosts, begun, days)
        name = f"{self._made}-{role}"
        return Identity(
            self.authority,
            self._put(f"{name}.pem", pair.certificate_pem),
            self._put(f"{name}.key", pair.key_pem),
        )

    def listener(self) -> Identity:
        return self.identity("haptic", ("127.0.0.1", "localhost"))

    def ended(self, role: str) -> Identity:
        """A certificate that ended yesterday."""
        return self.identity(role, days=1.0, begun=certificates.present() - timedelta(days=2))


def rig_file(folder: Path, ring: Keyring, role: str, more: str = "", mine: Identity | None = None) -> Path:
    """A rig file in this folder: of the haptic machine, or of one with another role."""
    mine = mine or (ring.listener() if role == "haptic" else ring.identity(role))
    end = 'public = "tls/0.0.0.0:7448"' if role == "haptic" else 'connect = "tls/haptic.local:7448"'
    text = (
        f'name = "stage"\n[zenoh]\n{end}\n[keys]\nauthority = "{mine.authority}"\n'
        f'certificate = "{mine.certificate}"\nprivate_key = "{mine.private_key}"\n{more}'
    )
    path = folder / "rig.toml"
    path.write_text(text)
    return path
