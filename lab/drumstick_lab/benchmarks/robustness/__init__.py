"""Faults, floods and inputs that nobody meant, by the million."""
