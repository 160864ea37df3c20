"""A rig with a device and an effect of another package: strikes come from its arm, and the drum is heard."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh
from osc_port import OscPort
from rig_process import DRUMSTICK, Listener, Rig, ask, running, wait_for

from drumstick.scenes.scene_text import shipped_text
from protocol.messages import STICK, Meter, Strike

# Nobody else has compiled this tick before.
pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def rig(own_package: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    scene = tmp_path_factory.mktemp("scene") / "sticky.toml"
    softer = shipped_text("phantom").replace("dv_m_per_s = 0.088", "dv_m_per_s = 0.05")
    scene.write_text(f"{softer}\n[effects.sticky]\nforce_N = 0.1\n", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(own_package), os.environ.get("PYTHONPATH", "")]))
        with running("up", "--scene", str(scene), "--device", "my_arm", "--audio", "null") as started:
            wait_for("its force loop", lambda: _plays(started), 600.0)
            yield started


def _plays(rig: Rig) -> bool:
    assert rig.process.poll() is None, rig.said
    return "1000 Hz, my arm" in rig.said


@pytest.mark.long
def test_its_arm_strikes_and_a_strike_by_osc_is_heard(rig: Rig, session: zenoh.Session, osc: OscPort) -> None:
    strikes, meters = Listener(session, rig.keys.strike, Strike), Listener(session, rig.keys.meter, Meter)
    wait_for("its arm's strikes", lambda: sum(strike.source == STICK for strike in strikes.got) > 3)
    osc.send("/drumstick/play/strike", 0.5, 0.0, 0.75)
    struck = wait_for("the strike", lambda: next((s for s in strikes.got if s.source != STICK), None))
    assert (struck.x, struck.level) == (0.5, 0.75)
    wait_for("its sound", lambda: any(meter.played > 3 and meter.peak_left > 0.0 for meter in meters.got))


@pytest.mark.long
def test_its_effects_value_is_set_live_within_what_the_envelope_lets(
    rig: Rig, session: zenoh.Session
) -> None:
    ask(session, rig.keys.set_many, {"sticky.force": 0.02})
    with pytest.raises(AssertionError, match=r"lower .*sticky.force"):
        ask(session, rig.keys.set_many, {"sticky.force": 5.0})


def test_a_device_that_no_package_gives_is_refused_before_anything_starts() -> None:
    refused = subprocess.run(
        [*DRUMSTICK, "up", "--device", "no_arm"], capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2
    assert "--device no_arm: there is simulated, pointer, openhaptics" in refused.stderr
