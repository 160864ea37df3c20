"""Lateness of the force loop, the cost of a tick, and a month of ticks."""
