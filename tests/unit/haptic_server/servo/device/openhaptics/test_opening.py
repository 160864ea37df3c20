"""Opening: the names that a driver may want are tried in turn, and the one that worked is said."""

import pytest

from haptic_server.servo.device.openhaptics.driver import names, opening
from haptic_server.servo.device.protocol import DeviceError
from hd_stand_in import StandIn

pytestmark = pytest.mark.needs("cc")


@pytest.fixture(autouse=True)
def _nothing_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(opening.VARIABLE, raising=False)


@pytest.mark.parametrize(
    ("configured", "said", "attempts"),
    [
        (b"", "the default (NULL)", ["init(NULL)"]),
        (b"Default Device", '"Default Device"', ["init(NULL)", "init(Default", "Device)"]),
        (
            b"Default PHANToM",
            '"Default PHANToM"',
            ["init(NULL)", "init(Default", "Device)", "init(Default", "PHANToM)"],
        ),
    ],
)
def test_each_known_name_is_tried_in_turn(
    arm: StandIn, configured: bytes, said: str, attempts: list[str]
) -> None:
    arm.sim("configure", configured)
    assert opening.open_device(arm.hd) == (7, said)
    assert arm.sim("diary").split() == attempts
    assert arm.hd.errors() == []


def test_a_name_from_the_environment_is_the_only_one_tried(
    arm: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm.sim("configure", b"left arm")
    with pytest.raises(DeviceError):
        opening.open_device(arm.hd)
    monkeypatch.setenv(opening.VARIABLE, "left arm")
    assert opening.open_device(arm.hd).name == '"left arm"'
    assert arm.sim("diary").endswith("init(left arm) ")


def test_all_refused_says_what_each_led_to_and_what_to_look_at(arm: StandIn) -> None:
    arm.sim("unplug", 1)
    with pytest.raises(DeviceError) as refusal:
        opening.open_device(arm.hd)
    text = str(refusal.value)
    assert text.count("the device does not answer (HD error 0x0302, internal 5)") == len(opening.KNOWN_NAMES)
    assert opening.VARIABLE in text
    assert "ttyACM" in text


def test_without_a_licence_no_other_name_is_tried(arm: StandIn) -> None:
    arm.sim("licence", 0)
    with pytest.raises(DeviceError, match="no valid licence"):
        opening.open_device(arm.hd)
    assert arm.sim("diary").count("init") == 1


def test_a_handle_with_an_error_is_no_open_device(arm: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str | None) -> int:
        handle = original(name)
        arm.library.hdEnable(0x4999)  # an error on the stack, as a driver that half works leaves one
        return handle

    original = arm.hd.init_device
    monkeypatch.setattr(arm.hd, "init_device", broken)
    with pytest.raises(DeviceError, match="a name that this driver does not know"):
        opening.open_device(arm.hd, [None])
    assert arm.sim("diary").split()[-1] == "disable"
    assert arm.hd.init_device(None) != names.INVALID_HANDLE
