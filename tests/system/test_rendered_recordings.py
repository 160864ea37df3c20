"""Sound rendered from a recording of a rig that plays."""

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from recorder_process import Recorder
from rig_process import DRUMSTICK, PATIENCE_S, Rig, running
from wav_heard import sound_in

from protocol.messages import Contact, decode
from rig.recording import channels
from rig.recording.reading import read
from streamed_engine import streamed_text


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    scene = tmp_path_factory.mktemp("scene") / "streamed.toml"
    scene.write_text(streamed_text(), encoding="utf-8")
    with running("haptic", "--scene", str(scene)) as started:
        yield started


def _loudness(sound: np.ndarray) -> float:
    # The median of tenths of a second: a stall of the machine spreads a contact's force over the ticks that it took,
    # and one such thump is louder than all the rest.
    tenths = sound[: 48_000 * 3].reshape(30, -1)
    return float(np.median(np.std(tenths, axis=1)))


@pytest.mark.usefixtures("session")
@pytest.mark.long
def test_what_was_recorded_is_rendered_by_its_forces_or_by_its_strikes(rig: Rig, tmp_path: Path) -> None:
    out, scene = tmp_path / "a.mcap", tmp_path / "streamed.toml"
    scene.write_text(streamed_text(), encoding="utf-8")
    recorder = Recorder(rig, out, "--force", "--duration", "6")
    assert recorder.ended()[0] == 0
    # A busy gateway streams late, after strikes that it had still to tell: each of the two by what was recorded of it.
    recording = read(out)
    pieces, strikes = recording.of(channels.CONTACT), recording.of(channels.STRIKE)
    contacts = {(p.boot, p.seq) for p in (decode(piece.payload, Contact) for piece in pieces)}
    assert len(contacts) > 20
    sounds: list[np.ndarray] = []
    for name, recorded, count in ((str(scene), pieces, len(contacts)), ("roll", strikes, len(strikes))):
        wav = tmp_path / "a.wav"
        command = [*DRUMSTICK, "render", name, "--strikes", str(out), "--out", str(wav), "--json"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert done.returncode == 0, done.stderr
        told = json.loads(done.stdout)
        # One may have begun before its first piece, one ended after.
        assert told["strikes"] == pytest.approx(count, abs=2)
        lasted_s = (recorded[-1].publish_ns - recorded[0].publish_ns) * 1e-9
        assert told["duration_s"] == pytest.approx(lasted_s + 1.0, abs=0.1), "all of it, and a second to ring"
        sounds.append(sound_in(wav)[:, 0])
    by_force, by_strikes = (_loudness(sound) for sound in sounds)
    assert by_force == pytest.approx(by_strikes, rel=0.5)
    assert by_strikes > 0.005
