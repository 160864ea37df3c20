"""Bounds of speed and force, the joint envelope of a set, and the fence: what may be accepted, and why not."""
