"""The rig file that `drumstick keys make` puts beside each machine's keys."""

from protocol.access.roles import HAPTIC, ROLES

PUBLIC_PORT = 7448  # not the loopback listener's 7447: a socket on every address would want that one too


def rig_file_text(role: str, rig: str, host: str, router: str | None = None) -> str:
    """Rig file for the machine that carries the keys of `role`; the haptic machine is reached at `host`.

    With `router` everybody connects to that machine, the haptic one too.
    """
    is_listener = role == HAPTIC and router is None
    return "\n".join(
        [
            "# Paths are relative to this file. What a line leaves out stays on this machine's loopback.",
            f'name = "{rig}"',
            "",
            "[zenoh]",
            *(_HAPTIC_ZENOH if is_listener else _client_zenoh(router or host)),
            "",
            "[keys]",
            'authority = "ca.pem"',
            f'certificate = "{role}.pem"',
            f'private_key = "{role}.key"',
            *(_HAPTIC_OSC if role == HAPTIC else []),
            "",
        ]
    )


_HAPTIC_ZENOH = [
    f'public = "tls/0.0.0.0:{PUBLIC_PORT}"',
    f"roles = [{', '.join(repr(name).replace(chr(39), chr(34)) for name in ROLES)}]",
]
_HAPTIC_OSC = [
    "",
    "# OSC knows no certificates: whoever is in `allow`, or can pretend to be, is heard.",
    "# [osc]",
    '# bind = "0.0.0.0:9100"  # every address of this machine, 127.0.0.1 too',
    '# targets = ["192.168.1.20:9101"]',
    '# allow = ["127.0.0.0/8", "192.168.1.20/32"]',
]


def _client_zenoh(host: str) -> list[str]:
    at = f"[{host}]" if ":" in host else host
    return [f'connect = "tls/{at}:{PUBLIC_PORT}"']
