"""The gateway's Zenoh side: a question that cannot be answered is refused, and the next one is heard."""

import math
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec
import pytest
import zenoh

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import block_header, files
from haptic_server.block_header import HEARTBEAT
from haptic_server.gateway.link import ServoLink, warm_up
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.gateway.settings import Parameters
from haptic_server.gateway.zenoh.play_queries import PlayQueries
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.presets.store import PresetStore
from haptic_server.set_list import SetList
from osc_bench import BOUND_S
from ports import free_port
from protocol.keys import Keys
from protocol.messages import Choke, Clock, LeaseRequest, PresetNews, RefusalReply, Strike, decode, encode
from protocol.session import open_router
from realtime.atomics import poke

ROLL = parse(shipped_text("roll"), "roll")
KEYS = Keys("wired")


def _no_health() -> Mapping[str, object]:
    raise FileNotFoundError(2, "No such file or directory", "servo.json")


@pytest.fixture
def panics() -> list[str]:
    """Sources of the panics."""
    return []


class Wired(NamedTuple):
    """A gateway's Zenoh side on a router, with what it changes."""

    session: zenoh.Session
    wire: Wire
    parameters: Parameters
    presets: Presets
    played: PlayedStrikes


@pytest.fixture
def wired(tmp_path: Path, panics: list[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Wired]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    warm_up(law_of(ROLL))  # what compiles, compiles before a query waits for it
    mine = blocks.create(tmp_path, law_of(ROLL))  # kept: the mapping lives as long as its views
    poke(mine.control, HEARTBEAT, time.monotonic_ns() + 3600 * 10**9)  # as if it ticked for an hour
    link = ServoLink(tmp_path, law_of(ROLL))
    session = open_router(endpoint)
    parameters = Parameters(ROLL, link)
    raise_panic = parameters.panic

    def noted(source: str) -> None:
        panics.append(source)
        raise_panic(source)

    monkeypatch.setattr(parameters, "panic", noted)
    presets = Presets(PresetStore(tmp_path / "state"), parameters, "roll", parameters.values())
    scenes = SceneRequests(tmp_path, True, parameters.require_quiet)
    wire = Wire(session, KEYS, parameters, lambda: mine.boot, "{}", _no_health, presets, scenes)
    played = PlayedStrikes(ROLL.strike, parameters)
    played.begin(wire.put_played, wire.put_release, wire.put_choke)
    plays = PlayQueries(KEYS, played, wire.queryables)
    yield Wired(session, wire, parameters, presets, played)
    plays.close()
    wire.close()
    session.close()


@pytest.fixture
def router(wired: Wired) -> zenoh.Session:
    return wired.session


def test_a_question_that_fails_does_not_silence_the_rest(router: zenoh.Session) -> None:
    refused = next(iter(router.get(KEYS.doctor, timeout=BOUND_S)))
    assert refused.err is not None
    assert "No such file" in decode(refused.err.payload.to_bytes(), RefusalReply).reason
    answered = next(iter(router.get(KEYS.clock, timeout=BOUND_S)))
    assert answered.ok is not None
    assert decode(answered.ok.payload.to_bytes(), Clock).t_ns > 0


def test_looking_around_is_no_panic(router: zenoh.Session, panics: list[str]) -> None:
    for pattern in ("drumstick/**", "drumstick/main/*", f"{KEYS.panic}/**"):
        list(router.get(pattern, timeout=2.0))
    assert panics == []
    answered = next(iter(router.get(KEYS.panic, timeout=BOUND_S)))
    assert answered.ok is not None
    assert panics == ["zenoh"]


# What each writing question would change, if it were heard.
WRITES: dict[str, bytes] = {
    KEYS.set_many: msgspec.msgpack.encode([1, {"dv_pls": 0.05}]),
    KEYS.set_one("*"): msgspec.msgpack.encode([1, 0.05]),
    KEYS.scene_load: msgspec.msgpack.encode([1, "tom"]),
    KEYS.lease: encode(LeaseRequest(who="secret", name="Ada")),
    KEYS.preset_load: msgspec.msgpack.encode([1, "kept"]),
    KEYS.preset_save: msgspec.msgpack.encode([1, "taken"]),
    KEYS.preset_rename: msgspec.msgpack.encode([1, ["kept", "taken"]]),
    KEYS.preset_delete: msgspec.msgpack.encode([1, "kept"]),
    KEYS.play_strike: msgspec.msgpack.encode([1, [0.1, 0.2, 0.5]]),
    KEYS.play_choke: b"",
    KEYS.panic: b"",
}


def wildcards_for(key: str) -> list[str]:
    """Patterns that stand for this key and others, or for it alone."""
    folder, _, name = key.rpartition("/")
    ends = f"{folder}/$*{name[-1]}" if name != "*" else f"{folder}/d$*"
    other_rigs = f"drumstick/*/{key.split('/', 2)[2]}"
    return ["drumstick/**", f"{folder}/*", f"{folder}/**", f"{key}/**", ends, other_rigs]


@pytest.mark.parametrize("key", WRITES)
def test_no_wildcard_changes_anything(wired: Wired, panics: list[str], tmp_path: Path, key: str) -> None:
    assert set(wired.wire.queryables.writing) == set(WRITES)  # every one of them is tried
    wired.presets.save("kept", "test")
    wired.parameters.set({"dv_pls": 0.1}, "test")

    def stands() -> tuple[object, ...]:
        names = [row.name for row in wired.presets.list()]
        return (
            wired.parameters.revision,
            wired.parameters.lease_holder(),
            names,
            (tmp_path / files.WANTED).exists(),
            wired.played.counters,
        )

    before = stands()
    for pattern in wildcards_for(key):
        list(wired.session.get(pattern, payload=WRITES[key], timeout=BOUND_S))
    assert stands() == before
    assert panics == []
    assert wired.wire.refused > 0


def test_a_strike_is_played_once_and_answered_with_what_was_told(wired: Wired) -> None:
    heard = wired.session.declare_subscriber(KEYS.strike, zenoh.handlers.RingChannel(8))
    payload = msgspec.msgpack.encode([1, [0.1, 0.2, 0.5, "page"]])
    reply = next(iter(wired.session.get(KEYS.play_strike, payload=payload, timeout=BOUND_S)))
    assert reply.ok is not None
    told = decode(reply.ok.payload.to_bytes(), Strike)
    assert (told.x, told.y, told.level, told.source) == (0.1, 0.2, 0.5, "zenoh page")
    assert decode(heard.recv().payload.to_bytes(), Strike) == told
    assert heard.try_recv() is None


@pytest.mark.parametrize(
    ("payload", "source"),
    [(b"", "zenoh"), (b'"Ada"', "zenoh Ada"), (msgspec.msgpack.encode([1, "page"]), "zenoh page")],
)
def test_a_choke_is_published_once_and_answered(wired: Wired, payload: bytes, source: str) -> None:
    heard = wired.session.declare_subscriber(KEYS.choke, zenoh.handlers.RingChannel(8))
    reply = next(iter(wired.session.get(KEYS.play_choke, payload=payload, timeout=BOUND_S)))
    assert reply.ok is not None
    told = decode(reply.ok.payload.to_bytes(), Choke)
    assert (told.source, told.seq) == (source, 1)
    assert decode(heard.recv().payload.to_bytes(), Choke) == told
    assert heard.try_recv() is None


@pytest.mark.parametrize("asked", [[1, 3], [1, "x" * 41], [1, "a\nb"]])
def test_a_choke_by_nobody_with_a_name_is_refused(wired: Wired, asked: object) -> None:
    reply = next(
        iter(wired.session.get(KEYS.play_choke, payload=msgspec.msgpack.encode(asked), timeout=BOUND_S))
    )
    assert reply.err is not None
    assert wired.played.counters.get("chokes", 0) == 0


@pytest.mark.parametrize(
    ("asked", "why"),
    [
        ([0.1, 0.2, math.nan], "level is nan"),
        ([9.0, 0.0, 0.5], "beside the head"),
        ([0.1, 0.2], "expected x, y, level"),
        ({"x": 1}, "expected x, y, level"),
    ],
)
def test_a_strike_that_is_none_is_refused_in_words(wired: Wired, asked: object, why: str) -> None:
    payload = msgspec.msgpack.encode([1, asked])
    reply = next(iter(wired.session.get(KEYS.play_strike, payload=payload, timeout=BOUND_S)))
    assert reply.err is not None
    assert why in decode(reply.err.payload.to_bytes(), RefusalReply).reason


def written(router: zenoh.Session, key: str, payload: bytes) -> PresetNews | str:
    """Answer to a query about a preset, or the reason of its refusal."""
    reply = next(iter(router.get(key, payload=payload, timeout=BOUND_S)))
    if reply.ok is None:
        return decode(reply.err.payload.to_bytes(), RefusalReply).reason
    assert str(reply.ok.key_expr) == key
    return decode(reply.ok.payload.to_bytes(), PresetNews)


def test_presets_are_renamed_and_deleted_by_msgpack_and_by_json(wired: Wired) -> None:
    router, packed = wired.session, msgspec.msgpack.encode
    wired.presets.save("slow", "test")
    assert written(router, KEYS.preset_rename, packed([1, ["slow", "fast"]])) == PresetNews(
        what="renamed", name="fast", before="slow"
    )
    assert written(router, KEYS.preset_rename, b'["fast", "slow"]') == PresetNews(
        what="renamed", name="slow", before="fast"
    )
    assert [row.name for row in wired.presets.list()] == ["slow"]
    assert written(router, KEYS.preset_delete, b'"slow"') == PresetNews(what="deleted", name="slow")
    assert "no preset 'slow'" in str(written(router, KEYS.preset_delete, packed([1, "slow"])))


@pytest.mark.parametrize(
    "asked", ["slow", ["slow"], ["slow", 3], ["slow", "fast", "faster"], {"slow": "fast"}]
)
def test_a_rename_that_names_no_two_is_refused(wired: Wired, asked: object) -> None:
    wired.presets.save("slow", "test")
    payload = msgspec.msgpack.encode([1, asked])
    assert "the present and the new name" in str(written(wired.session, KEYS.preset_rename, payload))
    assert [row.name for row in wired.presets.list()] == ["slow"]


def test_the_secret_of_a_lock_comes_with_the_query(wired: Wired) -> None:
    wired.presets.save("slow", "test")
    wired.parameters.take_lease("mine", "Ada", 5.0)
    for key, asked in ((KEYS.preset_rename, ["slow", "fast"]), (KEYS.preset_delete, "fast")):
        for refused in ([1, asked], [1, asked, {"lease": "yours"}]):
            assert "Ada is tuning" in str(written(wired.session, key, msgspec.msgpack.encode(refused)))
        mine = msgspec.msgpack.encode([1, asked, {"lease": "mine"}])
        assert isinstance(written(wired.session, key, mine), PresetNews)
    assert wired.presets.list() == []


def ask_for(router: zenoh.Session, name: object) -> str:
    """Objection to another scene; "": none."""
    reply = next(
        iter(router.get(KEYS.scene_load, payload=msgspec.msgpack.encode([1, name]), timeout=BOUND_S))
    )
    return decode(reply.err.payload.to_bytes(), RefusalReply).reason if reply.err is not None else ""


def test_another_scene_is_admitted_by_its_name_alone(router: zenoh.Session, tmp_path: Path) -> None:
    wanted = tmp_path / files.WANTED
    for wrong in ("../tom", "", "tom.toml", "x" * 5000):
        assert "no scene" in ask_for(router, wrong)
    assert "expected a name" in ask_for(router, 3)
    assert not wanted.exists()
    assert ask_for(router, "tom") == ""
    assert wanted.read_text() == "tom"


def test_next_asked_for_twice_is_two_steps(router: zenoh.Session, tmp_path: Path) -> None:
    (tmp_path / files.SET_LIST).write_text(SetList(("roll", "tom", "snare")).text())
    assert [ask_for(router, "next") for _ in range(2)] == ["", ""]
    assert (tmp_path / files.WANTED).read_text() == "2"
    assert "the set list ends with the one that comes" in ask_for(router, "next")


def test_no_other_scene_beside_a_lease_or_a_panic(router: zenoh.Session, tmp_path: Path) -> None:
    request = encode(LeaseRequest(who="secret", name="Ada"))
    assert next(iter(router.get(KEYS.lease, payload=request, timeout=BOUND_S))).ok is not None
    assert "Ada is tuning" in ask_for(router, "tom")
    given_back = encode(LeaseRequest(who="secret", name="Ada", seconds=0.0))
    assert next(iter(router.get(KEYS.lease, payload=given_back, timeout=BOUND_S))).ok is not None
    assert next(iter(router.get(KEYS.panic, timeout=BOUND_S))).ok is not None
    assert "drumstick arm" in ask_for(router, "tom")
    assert not (tmp_path / files.WANTED).exists()


def test_no_other_scene_in_the_place_of_a_servo_that_does_not_tick(
    router: zenoh.Session, tmp_path: Path
) -> None:
    there = block_header.read_header(tmp_path)
    assert there is not None
    poke(there.control, HEARTBEAT, 0)
    assert "the servo process does not tick" in ask_for(router, "tom")
    assert not (tmp_path / files.WANTED).exists()


def test_who_is_not_looked_after_says_so(tmp_path: Path) -> None:
    with pytest.raises(Refusal, match="not started by `drumstick`"):
        SceneRequests(tmp_path, False, lambda _claim: None).ask_for("tom")
