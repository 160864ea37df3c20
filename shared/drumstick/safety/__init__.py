"""Bounds of speed and force, the joint envelope of a set, and the fence: which sets are accepted, and
the reason for a refusal."""
