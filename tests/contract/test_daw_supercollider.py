"""The sound of docs/daw/files/drumstick.scd, computed by SuperCollider's server without an audio device."""

import re
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import soundfile

from osc_bench import client
from patching import headless

SCRIPT = Path(__file__).parents[2] / "docs" / "daw" / "files" / "drumstick.scd"

# Four blows, a second and a half apart: soft and hard in the middle, then hard at half radius and near the rim.
SCORE = """
~sound = false; ~port = {port};
"{file}".load;
fork {{
    var blows = [[0.2, 0], [0.8, 0], [0.8, 0.5], [0.8, 0.9]].collect {{ |blow, i|
        [i * 1.5, [\\s_new, \\drumstick, 1000 + i, 0, 0, \\level, blow[0], \\x, blow[1], \\y, 0]]
    }};
    var first = [[0.0, [\\d_recv, SynthDescLib.global[\\drumstick].def.asBytes]]];
    var score = Score(first ++ blows ++ [[6, [\\c_set, 0, 0]]]);
    score.recordNRT(
        outputFilePath: "{out}", headerFormat: "WAV", sampleFormat: "float", sampleRate: 48000,
        options: ServerOptions.new.numOutputBusChannels_(2), action: {{ 0.exit }});
}};
"""


def _peak_at(blow: npt.NDArray[np.float64], frequency_Hz: float) -> float:
    spectrum = np.abs(np.fft.rfft(blow))
    near = round(frequency_Hz * len(blow) / 48000)
    return float(spectrum[near - 5 : near + 6].max())


@pytest.mark.needs("sclang", "scsynth")
@pytest.mark.timeout(180)
def test_a_harder_blow_is_louder_and_one_off_the_middle_has_other_modes(tmp_path: Path) -> None:
    with client() as probe:
        port = probe.endpoint[1]
    script, out = tmp_path / "score.scd", tmp_path / "out.wav"
    script.write_text(SCORE.format(port=port, file=SCRIPT, out=out))
    done = subprocess.run(
        ["sclang", "-D", str(script)],
        env=headless(tmp_path),
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert not re.search("ERROR", done.stdout), done.stdout
    sound, rate_Hz = soundfile.read(out)
    assert rate_Hz == 48000
    assert 0.05 < np.abs(sound).max() < 1.0
    soft, hard, half, rim = (sound[i * 72000 : (i + 1) * 72000].sum(axis=1) for i in range(4))
    assert np.abs(hard).max() > 2.0 * np.abs(soft).max()
    assert 2.0 * _peak_at(hard, 150.0 * 1.594) < _peak_at(hard, 150.0)  # the middle does not excite that mode
    assert _peak_at(half, 150.0 * 1.594) > 4.0 * _peak_at(hard, 150.0 * 1.594)
    assert np.abs(rim).max() < np.abs(half).max()  # nothing moves at the rim
    right = np.abs(sound[144000:216000]).max(axis=0)
    assert right[1] > right[0]  # x = 0.5 is on the right
    for blow in (soft, hard, half, rim):
        assert np.abs(blow[-4800:]).max() < 1e-3 * np.abs(sound).max()
