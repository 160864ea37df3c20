"""Computations of one tick: latch, law, guard, velocity estimate; no allocation, no locks, no Python."""
