"""Conformance of effects and devices of one's own (docs/extend.md). Any thread; each check takes seconds.

>>> from drumstick import testing
>>> testing.check_effect("hysteretic_spring")
"""

from drumstick.testing.devices import check_device
from drumstick.testing.effects import check_effect
from drumstick.testing.rules import NotConforming

__all__ = ["NotConforming", "check_device", "check_effect"]
