"""`drumstick scene check` says what the servo would refuse at its start."""

from pathlib import Path

import pytest

from drumstick.scenes.scene_text import shipped_names
from rig.exit_status import CommandError
from rig.offline import scene_commands

HAMMERS = """
[stick]
m_kg = 0.075
k_coll_N_per_m = 3500.0
r_in_N_s_per_m = 75.0
k_hand_N_per_m = 60.0
r_out_N_s_per_m = 0.5
z_ss_m = -0.01
[device]
plant = "phantom"
delay_ticks = 1
[guard]
max_force_N = 8.5
"""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HAMMERS, "moving by itself.*lower k_coll"),
        (HAMMERS.replace("3500.0", "1000.0"), r"lower r_in to [\d.]+ N s/m"),
        ("[guard]\nmax_speed_m_per_s = 0.1\n[stick]\nk_hand_N_per_m = 1.0\n", r"throw at 0\.4 m/s"),
    ],
)
def test_a_scene_outside_the_envelope_is_not_called_good(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(CommandError, match=f"outside the envelope: .*{words}"):
        scene_commands.check(str(tmp_path / "mine.toml"))


@pytest.mark.parametrize("name", shipped_names())
@pytest.mark.daily("[!bfhlm]*", "bare-drum")  # the low and the wide ones take seconds to tune
def test_shipped_scenes_are_good(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    scene_commands.check(name)
    assert f"{name}: good" in capsys.readouterr().out


def test_a_scene_whose_drum_cannot_be_computed_is_not_called_good(tmp_path: Path) -> None:
    lossy = "[drum]\nf01_Hz = 150.0\n[drum.effects.internal_loss]\nt60_s = 0.001\nat_Hz = 400.0\n"
    (tmp_path / "mine.toml").write_text(lossy)
    with pytest.raises(CommandError, match=r"mine cannot be computed .* make the effects weaker"):
        scene_commands.check(str(tmp_path / "mine.toml"))
