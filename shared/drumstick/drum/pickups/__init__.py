"""Pickups that are moved while the drum plays: their places, and the crossfade that leads from one to the other."""
