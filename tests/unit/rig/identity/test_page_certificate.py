"""The page's certificate for phones: kept as long as it serves, and nobody else reads its key."""

from datetime import timedelta
from pathlib import Path

import pytest

from rig.identity import certificates
from rig.identity.page_certificate import page_certificate


def test_it_is_made_once_for_its_owner_only(tmp_path: Path) -> None:
    certificate, key = page_certificate(tmp_path / "state" / "main", "192.168.1.10")
    assert key.stat().st_mode & 0o077 == 0
    found = certificates.read_certificate(certificate.read_bytes())
    assert certificates.hosts_of(found) == ["192.168.1.10"]
    assert certificates.belongs(certificates.read_key(key.read_bytes()), found)
    before = certificate.read_bytes()
    page_certificate(tmp_path / "state" / "main", "192.168.1.10")
    assert certificate.read_bytes() == before


def test_another_host_or_a_key_that_others_read_gets_a_new_one(tmp_path: Path) -> None:
    certificate, key = page_certificate(tmp_path, "192.168.1.10")
    before = certificate.read_bytes()
    page_certificate(tmp_path, "192.168.1.11")
    assert certificate.read_bytes() != before
    before = certificate.read_bytes()
    key.chmod(0o644)
    page_certificate(tmp_path, "192.168.1.11")
    assert certificate.read_bytes() != before
    assert key.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("broken", ["panel.pem", "panel.key"])
def test_a_broken_file_is_replaced(tmp_path: Path, broken: str) -> None:
    certificate, key = page_certificate(tmp_path, "192.168.1.10")
    (certificate.parent / broken).write_text("nothing")
    page_certificate(tmp_path, "192.168.1.10")
    found = certificates.read_certificate(certificate.read_bytes())
    assert certificates.belongs(certificates.read_key(key.read_bytes()), found)


def test_one_that_ends_soon_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    certificate, _ = page_certificate(tmp_path, "192.168.1.10")
    before = certificate.read_bytes()
    later = certificates.present() + timedelta(days=340)
    monkeypatch.setattr(certificates, "present", lambda: later)
    page_certificate(tmp_path, "192.168.1.10")
    assert certificate.read_bytes() != before
