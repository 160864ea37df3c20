"""Mallets: their contact law, the tip on a mesh or on modes, and one solve for what pushes at once."""
