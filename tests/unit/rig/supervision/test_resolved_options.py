"""Command line and rig file together: the command line wins, and what neither says stays on loopback."""

from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from haptic_server.access.options import AccessOptions
from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.options import ServoOptions
from made_keys import Keyring, rig_file
from protocol.access.identity import Identity
from protocol.access.roles import ROLES
from protocol.keys import DEFAULT_ROUTER
from realtime.service_options import read
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.identity import certificates
from rig.options import AudioOptions, RigOptions, RoomOptions
from rig.supervision.plan import Options, commands
from rig.supervision.resolved_options import ResolvedOptions, resolve
from rig.supervision.rig_options import checked_options
from sound_server.options import SoundOptions
from sound_server.outputs import OutputPair
from web_panel.options import PanelOptions

ALL = frozenset({"haptic", "door", "sound", "panel"})


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Keyring:
    return Keyring(tmp_path_factory.mktemp("k"))


MODULES = {
    "servo": "haptic_server.servo",
    "gateway": "haptic_server.gateway",
    "door": "haptic_server.access",
    "sound": "sound_server",
    "panel": "web_panel",
}
READS = {
    "servo": ServoOptions,
    "gateway": GatewayOptions,
    "door": AccessOptions,
    "sound": SoundOptions,
    "panel": PanelOptions,
}


def plan_of(ends: ResolvedOptions, parts: frozenset[str]) -> dict[str, Any]:
    """Options of each service, as it reads them."""
    started = commands(
        Options(
            ends.rig, Path("/run"), Path("/state"), connect=ends.connect, listen=ends.listen, parts=parts,
            osc_targets=ends.osc_targets, osc_bind=ends.osc_bind, osc_allow=ends.osc_allow,
            public=ends.public, identity=ends.identity,
        )
    )  # fmt: skip
    assert [command[2] for command in started.values()] == [MODULES[name] for name in started]
    return {name: read(READS[name], command[-1]) for name, command in started.items()}


def test_without_anything_all_is_loopback() -> None:
    ends = resolve(ALL, None)
    assert ends == ResolvedOptions(
        "main", None, DEFAULT_ROUTER, None, None, ("127.0.0.1", 9100), ("127.0.0.1:9101",), ()
    )
    plan = plan_of(ends, ALL)
    assert "door" not in plan
    assert plan["gateway"].osc_allow == ()
    assert plan["gateway"].osc_out == (("127.0.0.1", 9101),)
    assert plan["sound"].identity is plan["panel"].identity is plan["gateway"].identity is None
    assert not any("0.0.0.0" in repr(each) or "tls/" in repr(each) for each in plan.values())


def test_the_file_speaks_and_the_command_line_wins(tmp_path: Path, ring: Keyring) -> None:
    osc = '[osc]\nbind = "192.168.1.10:9000"\ntargets = ["192.168.1.20:9001"]\nallow = ["192.168.1.0/24"]\n'
    path = rig_file(tmp_path, ring, "haptic", osc)
    ends = resolve(ALL, path)
    assert (ends.rig, ends.connect, ends.listen) == ("stage", None, DEFAULT_ROUTER)
    assert ends.public is not None
    assert ends.public.endpoint == "tls/0.0.0.0:7448"
    assert (ends.public.rigs, ends.public.roles) == (("stage",), tuple(ROLES))
    assert (ends.osc_bind, ends.osc_targets) == (("192.168.1.10", 9000), ("192.168.1.20:9001",))
    assert ends.osc_allow == ("192.168.1.0/24",)
    over = resolve(ALL, path, rig="other", listen="tcp/127.0.0.1:7999", osc_in=9999, osc_out=["127.0.0.1:1"])
    assert (over.rig, over.listen) == ("other", "tcp/127.0.0.1:7999")
    assert (over.osc_bind, over.osc_targets) == (("192.168.1.10", 9999), ("127.0.0.1:1",))
    assert over.public is not None
    assert over.public.rigs == ("other",)


def test_local_sound_and_panel_go_by_loopback_though_there_is_a_public_listener(
    tmp_path: Path, ring: Keyring
) -> None:
    plan = plan_of(resolve(ALL, rig_file(tmp_path, ring, "haptic")), ALL)
    public = plan["door"].public
    assert (public.endpoint, public.roles, public.rigs) == ("tls/0.0.0.0:7448", tuple(ROLES), ("stage",))
    for name in ("sound", "panel", "door"):
        assert plan[name].connect == DEFAULT_ROUTER
    for name in ("sound", "panel", "gateway"):
        assert plan[name].identity is None


@pytest.mark.parametrize("part", ["sound", "panel"])
def test_a_part_on_another_machine_shows_its_own_certificate(
    tmp_path: Path, ring: Keyring, part: str
) -> None:
    parts = frozenset({part})
    there = plan_of(resolve(parts, rig_file(tmp_path, ring, part)), parts)[part]
    assert there.connect == "tls/haptic.local:7448"
    assert there.identity.certificate.name.endswith(f"{part}.pem")
    here = plan_of(resolve(parts, tmp_path / "rig.toml", connect=DEFAULT_ROUTER), parts)[part]
    assert here.identity is None


def _ill(ring: Keyring, kind: str) -> Identity:
    hosts = ("127.0.0.1",)
    if kind == "later":
        return ring.identity("haptic", hosts, begun=certificates.present() + timedelta(days=3000))
    if kind == "ended":
        return ring.identity("haptic", hosts, begun=certificates.present() - timedelta(days=2))
    mine = ring.identity("haptic", hosts)
    return mine._replace(private_key=mine.private_key.with_name("gone"))


@pytest.mark.parametrize("kind", ["later", "ended", "gone"])
def test_the_gateway_does_not_judge_what_the_door_shows(tmp_path: Path, ring: Keyring, kind: str) -> None:
    path = rig_file(tmp_path, ring, "haptic", mine=_ill(ring, kind))
    haptic, door = frozenset({"haptic"}), frozenset({"door"})
    assert list(plan_of(resolve(haptic, path), haptic)) == ["servo", "gateway"]
    with pytest.raises(CommandError) as stop:
        resolve(door, path)
    # What time mends is tried again, what is wrong in the file is not.
    assert stop.value.status == (GIVEN if kind == "gone" else LACKING)
    path = rig_file(tmp_path, ring, "haptic")
    assert list(plan_of(resolve(door, path), door)) == ["door"]


@pytest.mark.parametrize("kind", ["later", "ended"])
def test_what_time_mends_keeps_no_force_from_starting(
    tmp_path: Path, ring: Keyring, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    ends = resolve(ALL, rig_file(tmp_path, ring, "haptic", mine=_ill(ring, kind)))
    assert ends.public is not None
    assert "nobody comes in" in capsys.readouterr().err


def test_nobody_asks_for_the_address_of_a_name_before_the_gateway_runs(tmp_path: Path, ring: Keyring) -> None:
    path = rig_file(tmp_path, ring, "haptic", '[osc]\ntargets = ["nosuch.invalid:9101"]\n')
    assert resolve(frozenset({"haptic"}), path).osc_targets == ("nosuch.invalid:9101",)
    assert resolve(ALL, None, osc_out=["nosuch.invalid:9101"]).osc_targets == ("nosuch.invalid:9101",)
    with pytest.raises(CommandError, match="write host:port"):
        resolve(ALL, None, osc_out=["nosuch.invalid"])


def test_targets_that_are_nobody(tmp_path: Path, ring: Keyring) -> None:
    path = rig_file(tmp_path, ring, "haptic", "[osc]\ntargets = []\n")
    assert plan_of(resolve(ALL, path), ALL)["gateway"].osc_out == ()


@pytest.mark.parametrize(
    "listen",
    ["tcp/0.0.0.0:7447", "tcp/192.168.1.10:7447", "tcp/[::]:7447", "tls/127.0.0.1:7447", "tcp/stage:7447"],
)
def test_only_loopback_is_open_to_those_without_a_certificate(listen: str) -> None:
    with pytest.raises(CommandError, match="whoever comes in there may do everything") as stop:
        resolve(ALL, None, listen=listen)
    assert stop.value.status == GIVEN
    for good in ("tcp/127.0.0.1:7999", "tcp/[::1]:7447", "tcp/localhost:7447", "tcp/127.1.2.3:7447"):
        assert resolve(ALL, None, listen=good).listen == good


def test_a_public_address_that_includes_the_loopback_one(tmp_path: Path, ring: Keyring) -> None:
    path = rig_file(tmp_path, ring, "haptic")
    with pytest.raises(
        CommandError, match=r"port 7448 is that of --listen tcp/127\.0\.0\.1:7448.*e\.g\. 7449"
    ):
        resolve(ALL, path, listen="tcp/127.0.0.1:7448")


def test_the_certificate_must_fit_the_part(tmp_path: Path, ring: Keyring) -> None:
    path = rig_file(tmp_path, ring, "listener")
    with pytest.raises(
        CommandError, match="is of 'listener'; drumstick sound needs the certificate of sound"
    ):
        resolve(frozenset({"sound"}), path)
    with pytest.raises(CommandError, match="each part needs a certificate of its own"):
        resolve(ALL, path)


def test_an_end_that_is_near_is_told_on_stderr(
    tmp_path: Path, ring: Keyring, capsys: pytest.CaptureFixture[str]
) -> None:
    resolve(frozenset({"sound"}), rig_file(tmp_path, ring, "sound"))  # the ring's last a day
    assert "sound.pem ends in 1 days; renew it" in capsys.readouterr().err


@pytest.mark.parametrize("listen", ["tcp/0.0.0.0:7447", "tcp/192.168.1.10:7447", "tls/127.0.0.1:7447"])
def test_a_router_without_rules_is_for_this_machine_only(listen: str) -> None:
    from rig.replaying.replay import ReplayOptions, checked

    with pytest.raises(CommandError, match="must be a loopback address over TCP"):
        resolve(ALL, None, listen=listen)
    with pytest.raises(CommandError, match="must be a loopback address over TCP"):
        checked(ReplayOptions(Path("x.mcap"), 1.0, False, False, listen, None, (), "/drumstick", 3600.0))


def test_tls_without_a_certificate_is_told_at_once() -> None:
    with pytest.raises(CommandError, match="must show a certificate"):
        resolve(frozenset({"sound"}), None, connect="tls/haptic.local:7448")


def test_outputs_of_a_whole_rig_reach_its_sound_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    audio = AudioOptions(outputs="own=3-4,other/pickup-1=1-2")
    options = checked_options(frozenset({"sound"}), RigOptions(rig="own"), audio, RoomOptions(also=["other"]))
    sound = read(SoundOptions, commands(options)["sound"][-1])
    assert sound.outputs == (OutputPair("own", "", 3, 4), OutputPair("other", "pickup-1", 1, 2))
    with pytest.raises(CommandError, match=r"--outputs: .*other"):
        checked_options(frozenset({"sound"}), RigOptions(rig="own"), audio)
