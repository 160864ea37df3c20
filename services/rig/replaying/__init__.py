"""A recording played again: in place of the haptic server, on the wires. Needs nothing of the services."""
