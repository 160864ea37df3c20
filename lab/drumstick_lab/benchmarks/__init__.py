"""Measurements of this machine, each a program: `drumstick lab` lists them."""

from drumstick_lab.checkout import share_tests

share_tests()
