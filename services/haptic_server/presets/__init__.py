"""Sets of parameters by name, and the last good one, as files of the haptic machine."""
