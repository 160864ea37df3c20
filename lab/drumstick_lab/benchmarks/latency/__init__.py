"""Delay from a strike to its sound, as a listener hears it."""
