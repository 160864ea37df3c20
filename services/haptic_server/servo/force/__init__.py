"""What one tick computes: latch, law, guard, velocity estimate; no allocation, no locks, no Python."""
