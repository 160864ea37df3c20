"""The C side: what ctypes believes of types and structs is what the C compiler does."""

import ctypes
from typing import Any

import pytest

from haptic_server.servo.device.openhaptics.driver import calls, names
from hd_stand_in import StandIn

pytestmark = pytest.mark.needs("cc")
SIZES = {
    4: calls.HHD,
    5: calls.Enum,
    6: calls.Int,
    7: calls.Boolean,
    8: calls.Short,
    9: calls.Long,
    10: calls.Double,
}


def test_the_error_struct_is_laid_out_as_c_does(arm: StandIn) -> None:
    ours = [ctypes.sizeof(calls.ErrorInfo)]
    ours += [getattr(calls.ErrorInfo, field).offset for field in ("code", "internal", "device")]
    assert ours == [arm.sim("layout", which) for which in range(4)] == [12, 0, 4, 8]


@pytest.mark.parametrize(("which", "kind"), SIZES.items())
def test_each_type_has_the_size_that_c_gives_it(arm: StandIn, which: int, kind: Any) -> None:
    assert ctypes.sizeof(kind) == arm.sim("layout", which)


def test_an_error_comes_back_by_value_with_its_sign(arm: StandIn) -> None:
    arm.sim("licence", 0)
    assert arm.hd.init_device(None) == names.INVALID_HANDLE
    (error,) = arm.hd.errors()
    assert (error.code, error.internal, error.device) == (names.INVALID_LICENSE, 11, 7)
    assert "licence" in str(error)
    assert "0x0600, internal 11" in str(error)
    assert arm.hd.errors() == []


def test_the_newest_error_comes_first(arm: StandIn) -> None:
    arm.sim("licence", 0)
    arm.hd.init_device(None)
    arm.sim("licence", 1)
    arm.sim("configure", b"other")
    arm.hd.init_device(None)
    assert [error.code for error in arm.hd.errors()] == [names.DEVICE_FAULT, names.INVALID_LICENSE]


def test_a_getter_that_fails_gives_nan_and_not_what_lay_there(arm: StandIn) -> None:
    arm.hd.init_device(None)
    assert str(arm.hd.doubles(0x2777)[0]) == "nan"
    assert [error.code for error in arm.hd.errors()] == [names.INVALID_ENUM]
