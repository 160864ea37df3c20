"""The other renderer: the head's modes themselves, for a linear drum with fixed pickups."""
