"""Computations of a tick and their memory: latch, law, guard, estimates, output; no allocation, no locks, no Python."""
