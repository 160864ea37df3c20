"""Options of the sound server: a restart for a lost device is who it was before; what is out of range is refused."""

import json
import re
from pathlib import Path

import msgspec
import pytest

from protocol.access.identity import Identity
from realtime.service_options import command, read
from sound_server.options import SoundOptions
from sound_server.outputs import outputs_of
from sound_server.process import again

IDENTITY = Identity(Path("ca.pem"), Path("sound.pem"), Path("sound.key"))


def test_a_restart_keeps_rigs_router_room_and_certificate() -> None:
    given = SoundOptions(
        rigs=("a", "x-*"), most_rigs=3, connect="tls/haptic.local:7448", block=64, identity=IDENTITY,
        room_latency_ms=12.5, room_level_dB=-3.0, outputs=outputs_of("a=1-2,x-1/microphone-2=3-4"),
    )  # fmt: skip
    assert read(SoundOptions, command("sound_server", given)[-1]) == given
    after = read(SoundOptions, again(given, "null")[-1])
    assert after == msgspec.structs.replace(given, audio="null", awaited=True)


def test_without_a_certificate_there_is_none_after_a_restart_either() -> None:
    assert read(SoundOptions, again(SoundOptions(), "null")[-1]).identity is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"room_latency_ms": 500.1}, "<= 500"),
        ({"room_latency_ms": -1}, ">= 0"),
        ({"room_level_dB": 13}, "<= 12"),
        ({"most_rigs": 9}, "<= 8"),
        (
            {"rigs": ["a", "b", "c", "x-*"], "most_rigs": 2},
            "3 rigs are more than the 2 that this server plays",
        ),
        ({"rigs": ["a", "*/b"]}, "*/b"),
        ({"rate": 8000}, "$.rate"),
        ({"identity": ["ca.pem"]}, "$.identity"),
        ({"blok": 64}, "blok"),
        (
            {"rigs": ["a", "x-*"], "outputs": [["b", "", 1, 2]]},
            "no rig b is played: this server plays a, x-*",
        ),
        ({"rigs": ["a"], "outputs": [["a", "", 1, 2], ["a", "", 3, 4]]}, "a has two pairs"),
        ({"rigs": ["a"], "outputs": [["a", "", 1, 65]]}, "channel 65 is outside 1 .. 64"),
        ({"rigs": ["a"], "outputs": [["a", "", 0, 1]]}, "channel 0 is outside 1 .. 64"),
        (
            {"rigs": ["a"], "outputs": [["a", "pickup-1", 3, 3]]},
            "a/pickup-1: left and right are both channel 3",
        ),
    ],
)
def test_what_is_outside_is_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        read(SoundOptions, json.dumps(options))
