"""A rig whose drum is excited by the force itself: real processes over Zenoh, into nothing and into a file."""

import os
import signal
import wave
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import zenoh
from rig_process import Listener, Rig, ask, running, wait_for

from protocol.messages import Contact, Meter, Release, Strike, encode
from streamed_engine import streamed_text

pytestmark = pytest.mark.system


def health(rig: Rig, session: zenoh.Session) -> dict[str, int | bool]:
    import json

    return json.loads(ask(session, rig.keys.doctor))["contact"]


@pytest.fixture(scope="module")
def wav(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("wav") / "roll.wav"


def scene_file(folder: Path) -> str:
    path = folder / "streamed.toml"
    path.write_text(streamed_text(), encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory, wav: Path) -> Iterator[Rig]:
    folder = tmp_path_factory.mktemp("streamed")
    with running("up", "--scene", scene_file(folder), "--audio", f"wav:{wav}") as started:
        yield started


def test_the_roll_sounds_by_its_forces(rig: Rig, wav: Path, session: zenoh.Session) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    first = wait_for("a contact", lambda: next((m for m in meters.got if m.played > 0), None))
    wait_for("thirty more", lambda: meters.got[-1].played >= first.played + 30)
    last = meters.got[-1]
    assert last.peak_left > 0.01
    assert (last.refused, last.duplicates) == (0, 0)

    def recorded() -> float:
        with wave.open(str(wav)) as file:
            return (
                float(np.abs(np.frombuffer(file.readframes(file.getnframes()), "<i2")).max(initial=0)) / 32767
            )

    wait_for("the sound in the file", lambda: recorded() > 0.05)


def test_what_is_published_adds_up_to_what_the_releases_tell(rig: Rig, session: zenoh.Session) -> None:
    pieces = Listener(session, rig.keys.contact, Contact)
    strikes = Listener(session, rig.keys.strike, Strike)
    releases = Listener(session, rig.keys.release, Release)
    wait_for("twenty contacts", lambda: len(releases.got) > 20)
    ended = list(releases.got)
    newest = ended[-1].seq

    def pieces_of(seq: int) -> list[Contact]:
        return [piece for piece in list(pieces.got) if piece.seq == seq]

    # Pieces, strikes and releases come by threads of their own; what was told before the newest is here with it.
    wait_for("its strike", lambda: any(strike.seq == newest for strike in list(strikes.got)))
    wait_for(
        "its last piece",
        lambda: any(np.frombuffer(each.forces, "<f4")[-1] == 0.0 for each in pieces_of(newest)),
    )
    told = {strike.seq: strike for strike in list(strikes.got)}
    whole = 0
    for release in ended:
        own = pieces_of(release.seq)
        if release.seq not in told or not own or told[release.seq].t_ns < own[0].t_ns:
            continue  # it had begun when we came
        forces = np.concatenate([np.frombuffer(piece.forces, "<f4") for piece in own]).astype(float)
        assert forces[-1] == 0.0
        assert forces.sum() / own[0].rate_Hz == pytest.approx(release.impulse_N_s, rel=1e-6)
        assert (own[0].x, own[0].y) == (told[release.seq].x, told[release.seq].y)
        assert own[0].boot == release.boot
        whole += 1
    assert whole >= 15


def test_nonsense_on_its_key_is_counted_and_the_roll_goes_on(rig: Rig, session: zenoh.Session) -> None:
    meters = Listener(session, rig.keys.meter, Meter)
    before = wait_for("a meter", lambda: meters.got[-1] if meters.got else None)
    for forces in ([float("nan")], [1e30], []):
        bad = Contact(
            boot=1,
            seq=1,
            first_tick=1,
            rate_Hz=1000.0,
            forces=np.array(forces, "<f4").tobytes(),
            t_ns=1,
            x=0.0,
            y=0.0,
        )
        session.put(rig.keys.contact, encode(bad))
    session.put(rig.keys.contact, b"\xff\x00")
    after = wait_for("it", lambda: next((m for m in meters.got if m.refused == before.refused + 4), None))
    wait_for("more contacts", lambda: meters.got[-1].played > after.played + 5)
    assert meters.got[-1].peak_left > 0.01


@pytest.mark.long
def test_a_killed_gateway_comes_back_and_so_does_the_sound(rig: Rig, session: zenoh.Session) -> None:
    old = rig.children()["haptic_server.gateway"]
    os.kill(old, signal.SIGKILL)
    wait_for("another gateway", lambda: rig.children().get("haptic_server.gateway", old) != old)
    meters = Listener(session, rig.keys.meter, Meter)
    first = wait_for("a meter", lambda: meters.got[-1] if meters.got else None)
    wait_for("new contacts", lambda: meters.got[-1].played > first.played + 10)


@pytest.mark.long
def test_nothing_is_published_while_nobody_listens(tmp_path: Path) -> None:
    with running("haptic", "--scene", scene_file(tmp_path)) as alone:
        session = alone.client()
        strikes = Listener(session, alone.keys.strike, Strike)
        wait_for("strikes", lambda: len(strikes.got) > 5)
        assert health(alone, session) == {"wanted": False, "put": 0, "dropped": 0, "stale": 0}
        heard = session.declare_subscriber(alone.keys.contact, lambda _: None)
        wait_for("pieces", lambda: health(alone, session)["put"] > 20)
        heard.undeclare()
        wait_for("the end of it", lambda: not health(alone, session)["wanted"])
        ended, seen = health(alone, session), len(strikes.got)
        wait_for("more strikes", lambda: len(strikes.got) > seen + 10)
        assert health(alone, session) == ended
        session.close()
