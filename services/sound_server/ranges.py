"""Ranges and defaults of a sound server's options: for its struct, and for commands that explain them.

`--help` reads them too, so nothing heavy is imported here.
"""

from drumstick.drum.rates import DEFAULT_RATE_HZ as DEFAULT_RATE_HZ
from drumstick.drum.rates import RATES_HZ as RATES_HZ

BLOCKS = (16, 8192)  # frames
DEFAULT_BLOCK = 128
MAX_RIGS = 8  # half the slots of the mixer: each drum may be followed by its next
MAX_DELAY_MS = 500.0  # of the room
GAINS_dB = (-60.0, 12.0)
