"""Excitation `streamed`: the contact's own force, tick by tick, from the wire into the mesh."""
