"""The haptic machine's two processes: the servo, which owns the device and runs the tick, and the gateway to the wires.

They share one memory-mapped file (`block`): strikes one way, parameter sets the other. The servo opens no socket.
"""
