"""Figures of who plays: the work of hands, and a drummer who holds a roll by grip."""
