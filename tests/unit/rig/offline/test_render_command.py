"""`drumstick render`: a WAV file that any program reads, the same each time, and clear words for wrong strikes."""

import json
import subprocess
import sys
import wave
from pathlib import Path

import numpy as np
import pytest

from streamed_engine import streamed_text


def drumstick(*given: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(Path(sys.executable).with_name("drumstick")), "render", *given],
        capture_output=True,
        text=True,
        check=False,
        timeout=220,
    )


def samples(path: Path) -> tuple[int, np.ndarray]:
    with wave.open(str(path)) as file:
        assert (file.getnchannels(), file.getsampwidth()) == (2, 2)
        frames = np.frombuffer(file.readframes(file.getnframes()), "<i2").reshape(-1, 2)
        return file.getframerate(), frames


def test_one_strike_at_half_radius_and_the_same_again(tmp_path: Path) -> None:
    files = [tmp_path / "one.wav", tmp_path / "two.wav"]
    for path in files:
        done = drumstick("bare-drum", "--out", str(path), "--duration", "0.7", "--json")
        assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["scene"], told["strikes"], told["duration_s"], told["rate_Hz"]) == (
        "bare-drum",
        1,
        0.7,
        48000,
    )
    rate, frames = samples(files[0])
    assert (rate, len(frames)) == (48000, 33600)
    assert np.abs(frames).max() == pytest.approx(told["peak"] * 32767, abs=1.0)
    assert not frames[:2400].any(), "silence before the strike"
    assert np.abs(frames[2400:7200]).max() > 1000
    assert files[0].read_bytes() == files[1].read_bytes()


def test_strikes_from_a_table(tmp_path: Path) -> None:
    table = tmp_path / "strikes.csv"
    table.write_text("t_s,x,y,speed_m_per_s\n0.1,0.5,0,1.0\n0.3,-0.2,0.1,0.5\n9.0,0,0,1\n")
    out = tmp_path / "played.wav"
    done = drumstick("bare-drum", "--out", str(out), "--duration", "0.5", "--strikes", str(table))
    assert done.returncode == 0, done.stderr
    assert "2 strikes" in done.stdout
    _, frames = samples(out)
    assert not frames[:4800].any()
    assert frames[4800:6000].any()


@pytest.mark.long
def test_a_roll_of_the_scenes_own_stick(tmp_path: Path) -> None:
    out = tmp_path / "roll.wav"
    done = drumstick("roll", "--out", str(out), "--duration", "1", "--roll", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["strikes"] in (21, 22, 23)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t_s,x,y\n0,0,0\n", "needs the columns t_s, x, y, speed_m_per_s"),
        ("t_s,x,y,speed_m_per_s\n0,0,0,fast\n", "speed_m_per_s: 'fast' is not a number"),
        ("t_s,x,y,speed_m_per_s\n0,0,0,1\n0,9,0,1\n", ":3: x: 9 is outside -2 .. 2"),
        ("t_s,x,y,speed_m_per_s\n0,0,0,nan\n", "speed_m_per_s: nan is outside 0 .. 100"),
        ("t_s,x,y,speed_m_per_s\n0,0,0\n", "speed_m_per_s: None is not a number"),
    ],
)
@pytest.mark.daily("*9 is outside*")
def test_wrong_strikes_are_named(tmp_path: Path, text: str, words: str) -> None:
    table = tmp_path / "strikes.csv"
    table.write_text(text)
    done = drumstick("bare-drum", "--out", str(tmp_path / "x.wav"), "--strikes", str(table))
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    done = drumstick("bare-drum", "--out", str(tmp_path / "nowhere" / "x.wav"))
    assert done.returncode == 3
    assert "cannot be written" in done.stderr
    assert drumstick("bare-drum", "--out", "x.wav", "--strikes", str(tmp_path / "none.csv")).returncode == 2


@pytest.mark.long
def test_pictures_and_the_table_of_modes(tmp_path: Path) -> None:
    out, drawn, modes = tmp_path / "a.wav", tmp_path / "a.png", tmp_path / "modes.svg"
    done = drumstick(
        "bare-drum",
        "--out",
        str(out),
        "--duration",
        "0.5",
        "--spectrogram",
        str(drawn),
        "--modes",
        str(modes),
        "--json",
    )
    assert done.returncode == 0, done.stderr
    assert drawn.read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in modes.read_bytes()
    table = json.loads(done.stdout)["modes"]
    assert [(mode["m"], mode["n"]) for mode in table[:5]] == [(0, 1), (1, 1), (2, 1), (0, 2), (3, 1)]
    heard = [mode for mode in table if mode["found_Hz"] is not None]
    assert len(heard) >= 11
    assert all(abs(mode["cents"]) < 3.0 for mode in heard)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--spectrogram", "a.jpg"), "give a file that ends in .png or .svg"),
        (("--modes", "a"), "give a file that ends in .png or .svg"),
        (("--spectrogram", "a.png", "--duration", "500"), "500 s are more than the 120 s that it draws"),
    ],
)
@pytest.mark.long
def test_pictures_that_cannot_be_drawn(options: tuple[str, ...], words: str, tmp_path: Path) -> None:
    done = drumstick("bare-drum", "--out", str(tmp_path / "a.wav"), *options)
    assert done.returncode == 2
    assert words in done.stderr
    assert not (tmp_path / "a.wav").exists()


def below(sound: np.ndarray, top_Hz: float) -> np.ndarray:
    """The part of a sound below a frequency, at 48 kHz."""
    spectrum = np.fft.rfft(sound)
    spectrum[np.fft.rfftfreq(len(sound), 1.0 / 48000) > top_Hz] = 0.0
    return np.fft.irfft(spectrum, len(sound))


@pytest.mark.long
def test_a_roll_of_a_scene_that_streams_is_rendered_by_its_forces(tmp_path: Path) -> None:
    scene = tmp_path / "streamed.toml"
    scene.write_text(streamed_text())
    files: list[np.ndarray] = []
    for name in (str(scene), "roll"):
        out = tmp_path / "roll.wav"
        done = drumstick(name, "--out", str(out), "--duration", "1.5", "--roll", "--json")
        assert done.returncode == 0, done.stderr
        assert 30 < json.loads(done.stdout)["strikes"] < 50
        files.append(below(samples(out)[1][:, 0].astype(float), 250.0))
    streamed, analytic = files
    # The same roll: as loud, and alike as far as 1000 forces a second reach.
    assert np.std(streamed) == pytest.approx(np.std(analytic), rel=0.1)
    assert np.corrcoef(streamed, analytic)[0, 1] > 0.95


def floats(path: Path) -> np.ndarray:
    # The standard library's `wave` reads whole numbers only.
    content = path.read_bytes()
    assert content[:4] == b"RIFF"
    assert int.from_bytes(content[20:22], "little") == 3, "floats"
    assert len(content) == 44 + int.from_bytes(content[40:44], "little")
    return np.frombuffer(content, "<f4", offset=44).reshape(-1, 2)


def test_stems_add_up_to_the_mix(tmp_path: Path) -> None:
    out, folder = tmp_path / "mix.wav", tmp_path / "new" / "stems"
    done = drumstick("bare-drum", "--out", str(out), "--stems", str(folder), "--duration", "0.4", "--json")
    assert done.returncode == 0, done.stderr
    files = [folder / "pickup-1.wav", folder / "pickup-2.wav"]
    assert json.loads(done.stdout)["stems"] == [str(path) for path in files]
    assert sorted(folder.iterdir()) == files
    total = sum(floats(path) for path in files)
    assert np.abs(total).max() > 0.01
    assert samples(out)[1] / 32767.0 == pytest.approx(total, abs=0.51 / 32767.0)


def test_stems_that_cannot_be_written_are_refused(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    done = drumstick("bare-drum", "--out", str(tmp_path / "mix.wav"), "--stems", str(in_the_way))
    assert (done.returncode, done.stdout) == (3, "")
    assert f"--stems {in_the_way}: cannot be written" in done.stderr


def test_a_mix_in_the_place_of_a_stem_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "pickup-1.wav"
    done = drumstick("bare-drum", "--out", str(out), "--stems", str(tmp_path / "x" / ".."))
    assert done.returncode == 2
    assert f"--out {out}: a stem is written to that file" in done.stderr
    assert not out.exists()
