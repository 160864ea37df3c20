"""Conformance of the effect and of the device."""

import my_drum

from drumstick import testing


def test_effect():
    """Every rule for effects."""
    testing.check_effect("sticky", my_drum.STICKY)


def test_device():
    """Every rule for devices."""
    testing.check_device("my_arm", my_drum.ARM)
