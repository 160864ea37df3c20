"""Counts of what the public listener and the gateway turn away, told to whoever may ask."""

from pathlib import Path

import pytest
import zenoh
from public_stage import Stage
from rig_process import PATIENCE_S, reason_of, reply_to, wait_for

from made_keys import Keyring
from protocol.session import client_config

pytestmark = pytest.mark.system


@pytest.mark.long
def test_who_is_turned_away_is_counted_and_told(stage: Stage, local: zenoh.Session, tmp_path: Path) -> None:
    before = stage.door(local)
    assert before["is_open"] is True
    foreign = Keyring(tmp_path / "foreign").identity("sound")
    with pytest.raises(zenoh.ZError):
        zenoh.open(
            client_config(stage.endpoint, foreign._replace(authority=stage.identity("sound").authority))
        )
    wait_for(
        "the count and its reason",
        lambda: (
            (now := stage.door(local))["handshakes_refused"] > before["handshakes_refused"]
            and "UnknownIssuer" in now["last"]
        ),
    )
    # The haptic machine's own certificate is of the authority, and of no role.
    with stage.client("haptic") as session:
        assert list(session.get(stage.keys.panic, timeout=PATIENCE_S)) == []
    wait_for("it in the count", lambda: stage.door(local)["without_role"] > before["without_role"])
    wait_for("a line", lambda: any("public listener: refused" in line for line in stage.rig.lines))
    told = stage.command("doctor", role="technician")
    assert f"public listener: {stage.endpoint}; here now: " in told
    assert "without a role" in told
    assert "rig file: " in told
    alone = stage.command("doctor", role="sound")  # it may not ask, and is told so
    assert "is of 'sound'; this command needs the certificate of" in alone


def test_a_message_that_the_gateway_refuses_is_counted(stage: Stage, local: zenoh.Session) -> None:
    before = stage.doctor(local)["queries_refused"]
    with stage.client("technician") as session:
        assert reason_of(reply_to(session, stage.keys.set_one("dv_pls"), b"1e9"))
    assert stage.doctor(local)["queries_refused"] > before
