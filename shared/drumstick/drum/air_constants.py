"""Air at 20 degrees Celsius, for what has no density of its own, as effect `air` has. Any thread."""

AIR_KG_PER_M3, SOUND_M_PER_S = 1.204, 343.2
