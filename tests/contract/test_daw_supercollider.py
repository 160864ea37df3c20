"""The sound of docs/daw/files/drumstick.scd, computed by SuperCollider's server without an audio device."""

import re
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from patching import headless
from ports import free_port

SCRIPT = Path(__file__).parents[2] / "docs" / "daw" / "files" / "drumstick.scd"

# Four blows, a second and a half apart: soft and hard in the middle, then hard at half radius and near the rim; and all
# again. A blow begins with noise, each time another: only the mean of many tells what it excites. The noise has a seed,
# so that all runs hear the same.
TURNS = 12
SCORE = """
~sound = false; ~port = {port};
"{file}".load;
fork {{
    var blows = Array.fill({turns}, [[0.2, 0], [0.8, 0], [0.8, 0.5], [0.8, 0.9]]).flatten(1).collect {{ |blow, i|
        [i * 1.5, [\\s_new, \\drumstick, 1000 + i, 0, 0, \\level, blow[0], \\x, blow[1], \\y, 0]]
    }};
    var seed = SynthDef(\\seed, {{ RandSeed.ir(1, 7) }});
    var defs = [SynthDescLib.global[\\drumstick].def, seed].collect {{ |def| [0.0, [\\d_recv, def.asBytes]] }};
    var first = defs ++ [[0.0, [\\s_new, \\seed, 999, 0, 0]]];
    var score = Score(first ++ blows ++ [[1.5 * blows.size, [\\c_set, 0, 0]]]);
    score.recordNRT(
        outputFilePath: "{out}", headerFormat: "WAV", sampleFormat: "float", sampleRate: 48000,
        options: ServerOptions.new.numOutputBusChannels_(2), action: {{ 0.exit }});
}};
"""


def _peak_at(blows: npt.NDArray[np.float64], frequency_Hz: float) -> float:
    spectrum = np.sqrt(np.mean(np.abs(np.fft.rfft(blows)) ** 2, axis=0))
    near = round(frequency_Hz * blows.shape[1] / 48000)
    return float(spectrum[near - 5 : near + 6].max())


def _loudest(blows: npt.NDArray[np.float64]) -> float:
    return float(np.median(np.abs(blows).max(axis=1)))


@pytest.mark.needs("sclang", "scsynth")
def test_a_harder_blow_is_louder_and_one_off_the_middle_has_other_modes(tmp_path: Path) -> None:
    port = free_port()
    script, out = tmp_path / "score.scd", tmp_path / "out.wav"
    script.write_text(SCORE.format(port=port, file=SCRIPT, out=out, turns=TURNS))
    done = subprocess.run(
        ["sclang", "-D", str(script)],
        env=headless(tmp_path),
        capture_output=True,
        text=True,
        check=False,
    )
    assert not re.search("ERROR", done.stdout), done.stdout
    sound, rate_Hz = soundfile.read(out)
    assert rate_Hz == 48000
    assert 0.05 < np.abs(sound).max() < 1.0
    blows = sound[: 72000 * 4 * TURNS].sum(axis=1).reshape(-1, 4, 72000)
    soft, hard, half, rim = (blows[:, i] for i in range(4))
    assert _loudest(hard) > 2.0 * _loudest(soft)
    assert 2.0 * _peak_at(hard, 150.0 * 1.594) < _peak_at(hard, 150.0)  # the middle does not excite that mode
    assert _peak_at(half, 150.0 * 1.594) > 3.0 * _peak_at(hard, 150.0 * 1.594)
    assert _loudest(rim) < _loudest(half)  # nothing moves at the rim
    right = np.abs(sound[144000:216000]).max(axis=0)
    assert right[1] > right[0]  # x = 0.5 is on the right
    assert np.abs(blows[..., -4800:]).max() < 1e-3 * np.abs(sound).max()
