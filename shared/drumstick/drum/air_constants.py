"""Air at 20 degrees Celsius, for all that a drum does to it. Any thread."""

AIR_KG_PER_M3, SOUND_M_PER_S = 1.204, 343.2
