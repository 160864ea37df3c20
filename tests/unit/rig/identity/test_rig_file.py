"""The rig file: what it says, and every mistake in it at once, with its line."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.access.identity import Identity
from protocol.access.roles import HAPTIC, ROLES
from rig.exit_status import GIVEN, CommandError
from rig.identity.rig_file import MAX_BYTES, RigFile, RigFileError, load, parse
from rig.identity.rig_template import PUBLIC_PORT, rig_file_text

HERE = Path("/rigs/stage")
KEYS = '[keys]\nauthority = "ca.pem"\ncertificate = "haptic.pem"\nprivate_key = "/secret/haptic.key"\n'
WHOLE = f"""name = "stage-left"

[zenoh]
public = "tls/0.0.0.0:7448"
roles = ["sound", "panel", "sound"]
also = ["stage-right"]

{KEYS}
[osc]
bind = "0.0.0.0:9100"
targets = ["192.168.1.20:9101", "127.0.0.1:9101"]
allow = ["127.0.0.0/8", "192.168.1.20/32"]
"""


def mistakes(text: str) -> list[str]:
    with pytest.raises(RigFileError) as refused:
        parse(text, "stage/rig.toml", HERE)
    return refused.value.mistakes


def test_all_of_it() -> None:
    assert parse(WHOLE, "rig.toml", HERE) == RigFile(
        name="stage-left",
        public="tls/0.0.0.0:7448",
        roles=("sound", "panel"),
        also=("stage-right",),
        identity=Identity(HERE / "ca.pem", HERE / "haptic.pem", Path("/secret/haptic.key")),
        osc_bind=("0.0.0.0", 9100),
        osc_targets=("192.168.1.20:9101", "127.0.0.1:9101"),
        osc_allow=("127.0.0.0/8", "192.168.1.20/32"),
    )


def test_nothing_of_it() -> None:
    nothing = parse("", "rig.toml", HERE)
    assert nothing == RigFile()
    assert nothing.public is None
    assert nothing.osc_allow is None
    assert parse("[osc]\ntargets = []\n", "rig.toml", HERE).osc_targets == ()  # to nobody is not the default


@pytest.mark.parametrize("role", [HAPTIC, *ROLES])
@pytest.mark.parametrize("host", ["haptic.local", "192.168.1.10", "fd00::1"])
def test_what_keys_make_writes_can_be_read(role: str, host: str) -> None:
    made = parse(rig_file_text(role, "main", host), "rig.toml", HERE)
    assert made.name == "main"
    assert made.identity == Identity(HERE / "ca.pem", HERE / f"{role}.pem", HERE / f"{role}.key")
    at = f"[{host}]" if ":" in host else host
    assert made.connect == (None if role == HAPTIC else f"tls/{at}:{PUBLIC_PORT}")
    assert made.public == (f"tls/0.0.0.0:{PUBLIC_PORT}" if role == HAPTIC else None)
    assert made.roles == tuple(ROLES)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ('nme = "a"', 1, "nme: unknown key; known here: name, zenoh, keys, osc"),
        ('\nname = "a b"', 2, "name: rig name 'a b': use 1 to 40 letters"),
        ("name = 3", 1, "name: 3 must be text in quotes"),
        ("zenoh = 3", 1, "zenoh: must be a table, not 3"),
        ('[zenoh]\npublik = "x"', 2, "zenoh.publik: unknown key, given 'x'; did you mean public"),
        ('[zenoh]\npublic = "tcp/0.0.0.0:7448"', 2, "other machines come in over TLS only"),
        ('[zenoh]\npublic = "tls/0.0.0.0"', 2, "is not a Zenoh endpoint like"),
        ('[zenoh]\npublic = "tls/0.0.0.0:7448"', 2, "zenoh.public: tls/ needs [keys]"),
        ('[zenoh]\nconnect = "tcp/192.168.1.10:7447"', 2, "another machine is reached over TLS only"),
        ('[zenoh]\nroles = ["sond"]', 2, "zenoh.roles: 'sond' is no role; there is sound, panel"),
        ('[zenoh]\nroles = "sound"', 2, "zenoh.roles: 'sound' must be a list of at most 64 texts"),
        ('[zenoh]\nalso = ["a/b"]', 2, "zenoh.also: rig name 'a/b'"),
        ('[keys]\nauthority = "ca.pem"', 1, "keys.certificate: missing: the three of authority"),
        ('[keys]\nauthority = ""\ncertificate = "c"\nprivate_key = "k"', 2, "keys.authority: '' must name"),
        ('[osc]\nbind = "9100"', 2, "osc.bind: '9100' must be host:port with a port of 1 .. 65535"),
        ('[osc]\nbind = "192.168.1.10:9100"', 2, "osc.bind: is open to the network, but nobody is allowed"),
        ('[osc]\ntargets = ["a:99999"]', 2, "osc.targets: 'a:99999' must be host:port"),
        ("[osc]\nallow = [3]", 2, "osc.allow: 3 must be text in quotes"),
        ('[osc]\nallow = ["192.168.1.7/24"]', 2, "must be an IPv4 network like 192.168.1.0/24"),
        ('[osc]\nallow = ["0.0.0.0/0"]', 2, "is nearly everybody: /8 is the widest"),
        ("name = ", None, "not valid TOML"),
    ],
)
def test_a_mistake_names_its_line(text: str, line: int | None, words: str) -> None:
    place = "stage/rig.toml" + (f":{line}: " if line else ": ")
    assert any(m.startswith(place) and words in m for m in mistakes(text)), mistakes(text)


def test_a_machine_listens_or_connects() -> None:
    both = '[zenoh]\npublic = "tls/0.0.0.0:7448"\nconnect = "tls/haptic.local:7448"\n' + KEYS
    assert mistakes(both) == [
        "stage/rig.toml:3: zenoh.connect: a machine has a public listener or connects to one: leave one of them out"
    ]


def test_every_mistake_at_once() -> None:
    found = mistakes('name = 3\n[zenoh]\nroles = ["x"]\n[osc]\nbind = "x"\nallow = ["y"]\n')
    assert [m.split(": ")[0] for m in found] == [f"stage/rig.toml:{n}" for n in (1, 3, 5, 6)]


@given(text=st.text(max_size=200) | st.sampled_from([WHOLE]).flatmap(lambda w: st.text(w, max_size=300)))
def test_any_text_is_read_or_refused_in_words(text: str) -> None:
    try:
        parse(text, "rig.toml", HERE)
    except RigFileError as error:
        assert error.mistakes
        assert all(m.startswith("rig.toml") for m in error.mistakes)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    with pytest.raises(CommandError, match="cannot be read: No such file") as stop:
        load(path)
    assert stop.value.status == GIVEN
    path.write_bytes(b"\xff")
    with pytest.raises(CommandError, match="not UTF-8"):
        load(path)
    path.write_text(" " * (MAX_BYTES + 1))
    with pytest.raises(CommandError, match=f"more than {MAX_BYTES} bytes"):
        load(path)
    path.write_text("x = 1\n")
    with pytest.raises(CommandError, match=r"rig\.toml:1: x: unknown key") as stop:
        load(path)
    assert stop.value.status == GIVEN
