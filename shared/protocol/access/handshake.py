"""Reasons why a TLS endpoint does not let us in, in words. Zenoh only says "Timeout!".

One handshake of Python's own ssl with the same three files tells what went wrong, from both ends: our own check of the
other's certificate, and in TLS 1.3 the other's alert about ours, which comes just after the handshake. It costs the
listener what every failed handshake costs it (100 ms in which nobody else can join), so it is asked seldom.
"""

from __future__ import annotations

import socket
import ssl
from typing import NamedTuple

from protocol.access.identity import Identity
from protocol.endpoint import host_and_port

_PATIENCE_S = 1.0
_ALERT_WITHIN_S = 0.5

# Alerts by which a TLS 1.3 listener refuses a client, by OpenSSL's names for them.
_ALERTS = {
    "CERTIFICATE_REQUIRED": "it requires a certificate, and none was sent",
    "CERTIFICATE_EXPIRED": "our certificate is out of date there: renew it with `drumstick keys make --renew`",
    "UNKNOWN_CA": "our certificate is not of its authority",
    "DECRYPT_ERROR": "our certificate is not of its authority",
    "BAD_CERTIFICATE": "it cannot read our certificate",
    "CERTIFICATE_UNKNOWN": "it does not accept our certificate",
    "UNSUPPORTED_CERTIFICATE": "our certificate is not one for clients",
    "ACCESS_DENIED": "it refuses our certificate",
}
_EXPIRED, _NOT_YET, _OTHER_NAME, _OTHER_IP = 10, 9, 62, 64  # OpenSSL's X509_V_ERR_ numbers


class TlsRefusal(NamedTuple):
    """Reason why a TLS endpoint refuses us, whether anything answers there at all, and whether it may only be slow."""

    words: str
    somebody_is_there: bool = True
    may_be_slow: bool = False


def why_refused(endpoint: str, identity: Identity) -> TlsRefusal | None:
    """None when the handshake succeeds now. Blocks up to two seconds; any ordinary thread."""
    host, port = host_and_port(endpoint)
    at = f"{endpoint} cannot be joined"
    try:
        context = _context(identity)
    except OSError as error:  # ssl.SSLError is one
        return TlsRefusal(f"{at}: our own certificate, key or authority cannot be used: {error}", False)
    try:
        with (
            socket.create_connection((host, port), timeout=_PATIENCE_S) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            return TlsRefusal(f"{at}: it closed the connection") if _is_closed(link) else None
    except ssl.SSLCertVerificationError as error:
        return TlsRefusal(f"{at}: {_of_their_certificate(error, host)}")
    except ssl.SSLError as error:
        return TlsRefusal(f"{at}: {_of_alert(error)}")
    except OSError as error:
        words = f"{at}: no TLS server answers there ({error.strerror or error})"
        return TlsRefusal(words, False, isinstance(error, TimeoutError))


def _is_closed(link: ssl.SSLSocket) -> bool:
    # In TLS 1.3 the other end judges our certificate after our end of the handshake; its alert is raised by recv.
    link.settimeout(_ALERT_WITHIN_S)
    try:
        return link.recv(1) == b""
    except TimeoutError:
        return False


def _context(identity: Identity) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # checks the name and the chain
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.load_verify_locations(identity.authority)
    context.load_cert_chain(identity.certificate, identity.private_key)
    return context


def _of_their_certificate(error: ssl.SSLCertVerificationError, host: str) -> str:
    if error.verify_code == _EXPIRED:
        return "its certificate is out of date: renew the haptic machine's with `drumstick keys make --renew haptic`"
    if error.verify_code == _NOT_YET:
        return "its certificate is not valid yet: is the clock of this machine right?"
    if error.verify_code in (_OTHER_NAME, _OTHER_IP):
        return f"its certificate is not for the name {host}: connect by a name that it was made for (keys make --host)"
    return f"its certificate is not of our authority ({error.verify_message})"


def _of_alert(error: ssl.SSLError) -> str:
    reason = error.reason or ""
    for name, words in _ALERTS.items():
        if reason.endswith(name):
            return words
    return f"the TLS handshake failed: {reason or error}"
