"""Drums solved in closed form beside those that are played, and what two sounds of a drum differ by, with its sign."""
