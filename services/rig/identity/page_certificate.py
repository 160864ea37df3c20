"""The certificate by which phones know the page (--panel-lan): made here, by nobody else's authority, and kept in the
rig's state folder so that a phone that was told to trust it goes on doing so.
"""

from pathlib import Path

from realtime.regular_file import read_bytes
from rig.exit_status import unavailable
from rig.identity import keys

FOLDER, CERTIFICATE, KEY = "panel-lan", "panel.pem", "panel.key"
DAYS = 365
_AT_LEAST_DAYS = 30  # a run that lasts weeks


def page_certificate(state: Path, host: str) -> tuple[Path, Path]:
    """Certificate and key for `host`; made anew where there is none, it is another host's, or it ends within 30 days.
    Raises CommandError."""
    from rig.identity import certificates

    folder = state / FOLDER
    certificate, key = folder / CERTIFICATE, folder / KEY
    if not _serves(certificate, key, host):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            unavailable(f"{folder} cannot be made: {error.strerror}")
        now = certificates.present()
        authority = certificates.new_authority("the page", now)  # its key is forgotten: it signs nothing else
        keys.put_pair(folder, KEY, CERTIFICATE, certificates.new_pair(authority, "page", [host], now, DAYS))
    return certificate, key


def _serves(certificate: Path, key: Path, host: str) -> bool:
    from rig.identity import certificates

    try:
        found = certificates.read_certificate(read_bytes(certificate, certificates.MAX_PEM))
        owner = certificates.read_key(read_bytes(key, certificates.MAX_PEM))
    except (OSError, ValueError):
        return False  # whatever it is, a new one takes its place
    return (
        certificates.belongs(owner, found)
        and certificates.hosts_of(found) == [host]
        and certificates.days_left(found, certificates.present()) > _AT_LEAST_DAYS
        and not key.stat().st_mode & 0o077
    )
