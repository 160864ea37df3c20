"""Making and reading certificates: one small authority, one certificate for each role. No files here.

EC keys on P-256, signed with SHA-256. Only the haptic machine's certificate may stand for a server, and only for the
hosts it was made for; a role's common name is the role. `cryptography` is imported by those who call.
"""

from __future__ import annotations

import ipaddress
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

_EARLIER = timedelta(hours=1)  # clocks on a stage differ
AUTHORITY_DAYS = 3650
MAX_PEM = 1_000_000  # bytes of a file; ours have some hundred


@dataclass(frozen=True)
class Pair:
    """A private key and its certificate."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate

    @property
    def key_pem(self) -> bytes:
        """The key, PKCS 8, without a password: who reads the file is who it says."""
        return self.key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )

    @property
    def certificate_pem(self) -> bytes:
        """The certificate."""
        return self.certificate.public_bytes(serialization.Encoding.PEM)


def _named(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _begun(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, now: datetime, days: float
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLIER)
        .not_valid_after(now + timedelta(days=days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates, content_commitment=False, key_encipherment=False,
        data_encipherment=False, key_agreement=False, key_cert_sign=signs_certificates,
        crl_sign=signs_certificates, encipher_only=False, decipher_only=False,
    )  # fmt: skip


def new_authority(rig: str, now: datetime) -> Pair:
    """An authority of its own name: two for the same rig are told apart."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = _named(f"haptic-drumstick authority of {rig}, {secrets.token_hex(4)}")
    certificate = (
        _begun(name, name, key, now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return Pair(key, certificate)


def new_pair(authority: Pair, role: str, hosts: Sequence[str], now: datetime, days: float) -> Pair:
    """A certificate of `role` for `days`; with `hosts` also for a server of these names and addresses."""
    key = ec.generate_private_key(ec.SECP256R1())
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if hosts else [])]
    issuer = authority.key.public_key()
    builder = (
        _begun(_named(role), authority.certificate.subject, key, now, days)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer), critical=False)
    )
    if hosts:
        names = [_general_name(host) for host in hosts]
        builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    return Pair(key, builder.sign(authority.key, hashes.SHA256()))


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def read_certificate(pem: bytes) -> x509.Certificate:
    """The first certificate of a PEM file; ValueError when there is none."""
    return x509.load_pem_x509_certificate(pem)


def read_key(pem: bytes) -> ec.EllipticCurvePrivateKey:
    """An EC key without a password; ValueError for anything else."""
    try:
        key = serialization.load_pem_private_key(pem, password=None)
    except TypeError:  # how the library says that it needs a password
        raise ValueError("locked with a password; a service has nobody to ask for it") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError("not a key on an elliptic curve, as `drumstick keys make` makes them")
    return key


def name_of(certificate: x509.Certificate) -> str:
    """The common name: a role. Empty when there is none."""
    found = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(found[0].value) if found else ""


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """Host names of a server that shows this certificate."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in names]


def is_of(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """True when the authority signed it."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def belongs(key: ec.EllipticCurvePrivateKey, certificate: x509.Certificate) -> bool:
    """True when it is this certificate's key."""
    return key.public_key() == certificate.public_key()


def days_left(certificate: x509.Certificate, now: datetime) -> float:
    """Days until it ends; negative when it has."""
    return (certificate.not_valid_after_utc - now).total_seconds() / 86400.0


def present() -> datetime:
    """Now."""
    return datetime.now(UTC)
