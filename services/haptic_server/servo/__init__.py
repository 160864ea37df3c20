"""The servo: the process that owns the device and runs the tick. No sockets, no Python in the tick."""
