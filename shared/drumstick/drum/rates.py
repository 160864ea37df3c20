"""Sample rates at which a drum can be computed."""

RATES_HZ = (22_050, 192_000)  # below it a high drum would have too few junctions to be one
DEFAULT_RATE_HZ = 48_000
