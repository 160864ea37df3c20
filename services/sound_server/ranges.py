"""Ranges and defaults of a sound server's options: for its struct, and for commands that explain them.

`--help` reads them too, so nothing heavy is imported here.
"""

RATES_HZ = (22_050, 192_000)  # below it a high drum would have too few junctions to be one
BLOCKS = (16, 8192)  # frames
DEFAULT_RATE_HZ, DEFAULT_BLOCK = 48_000, 128
MAX_RIGS = 8  # half the slots of the mixer: each drum may be followed by its next
MAX_DELAY_MS = 500.0  # of the room
GAINS_dB = (-60.0, 12.0)
